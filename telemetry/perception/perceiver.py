"""One sensor's perception, fed with what the bus or a recording holds: no threads, no sockets, no clock of its own."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter
from typing import Any, NamedTuple

from mapping.errors import MappingError
from mapping.perceiving.frame_result import FrameResult
from mapping.perceiving.ground import GroundGrid
from mapping.sensor_frames import SensorFrame, SlamPose
from mapping.voxels.checks import checked_size
from telemetry.perception.mission_line import FlownLine
from telemetry.perception.sensor_kinds import SensorKind
from telemetry.perception.status import Outcome, Teller
from telemetry.perception.whereabouts import Whereabouts, has_fix, is_flying, velocity_enu_m_s
from telemetry.topics.messages import PlanRecord
from telemetry.topics.obstacles import (
    Basis,
    GroundNotice,
    MapOrigin,
    MissionConflict,
    PerceptionSettings,
    PerceptionStatus,
)
from telemetry.topics.vehicle import VehicleState

_MOST_BUFFERED = 2000
BROKEN = "broken frame"
SKIPPED = "skipped: the node was behind"


class GroundWanted(NamedTuple):
    """Which surface model is to be laid under which map."""

    notice: GroundNotice | None
    origin: MapOrigin | None


class Perceiver:
    """Takes states, poses and settings as they come; they count from the next frame on, in the order of their times.

    So a map depends on what was known when each frame was worked on, which its status tells (``Basis``), and on
    nothing else. All times are of one monotonic clock.
    """

    def __init__(self, kind: SensorKind, *, run: str, utc_minus_mono_s: float) -> None:
        """``run`` makes the ids of alerts this run's own."""
        self.kind = kind
        self.where = Whereabouts()
        self.flown = FlownLine()
        self.settings = PerceptionSettings()
        self.conflict: MissionConflict | None = None
        self.pose_t_mono_s = -math.inf
        """Up to when poses are known: a frame of before then is best worked on now."""
        self.notice: GroundNotice | None = None
        self.begun = 0
        """How often the map began afresh."""
        self._run = run
        self._teller = Teller(kind, utc_minus_mono_s)
        self._waiting: deque[tuple[float, VehicleState | SlamPose]] = deque(maxlen=_MOST_BUFFERED)
        self._armed = False
        self._ground: GroundGrid | None = None
        self._position_t_s = self._attitude_t_s = -math.inf
        self._basis = Basis(0.0, run=run)
        self._dropped: Counter[str] = Counter()
        self.perception = self._made()

    # What comes in

    def on_state(self, state: VehicleState) -> None:
        times = [t for t in (state.position_t_mono_s, state.attitude_t_mono_s) if t is not None]
        self._waiting.append((max(times, default=-math.inf), state))
        if len(times) == 2 and not self.kind.uses_camera:
            self.pose_t_mono_s = max(self.pose_t_mono_s, min(times))

    def on_camera(self, pose: SlamPose) -> None:
        if not math.isfinite(pose.t_mono_s):
            self._dropped["pose: not finite"] += 1
            return
        self._waiting.append((pose.t_mono_s, pose))
        self.pose_t_mono_s = max(self.pose_t_mono_s, pose.t_mono_s)

    def on_settings(self, settings: PerceptionSettings) -> None:
        """What cannot be done is refused as a whole, and said; then the settings before stay."""
        wanted = self.kind.settings(settings)
        try:
            checked_size(wanted.resolution_m, self.kind.reach_m, wanted.memory_limit_bytes)
            self.perception.set_settings(wanted)
        except MappingError as error:
            self._teller.notes["settings"] = f"The settings are refused: {error.what} {error.advice}"
            return
        self._teller.note("settings", "")
        old, self.settings = self.settings, settings
        if self.perception.frames == 0:
            return
        if self.kind.settings(old).makes_another_map(wanted):
            self._begin_afresh(f"The map begins anew, with voxels of {wanted.resolution_m:g} m.")
        elif settings.clear_count != old.clear_count:
            self._begin_afresh("The map was emptied.")

    def on_plan(self, plan: PlanRecord) -> None:
        self.flown.plan = plan

    def on_ground(self, notice: GroundNotice | None) -> None:
        self.notice = notice

    @property
    def ground_wanted(self) -> GroundWanted:
        """Whoever drives this loads it and calls ``set_ground``, each time that it changes."""
        return GroundWanted(self.notice, self.where.origin)

    def set_ground(self, ground: GroundGrid | None, why_none: str = "") -> None:
        self._ground = ground
        self.perception.set_ground(ground)
        self._teller.note("ground", why_none)

    def skip(self, count: int) -> None:
        """So many frames were left out, because there were newer ones already."""
        self._dropped[SKIPPED] += count

    # What goes out

    def work(self, frame: SensorFrame, clock: Callable[[], float]) -> Outcome[PerceptionStatus]:
        """One frame into the map; never raises for what is in it."""
        now_s = clock()
        if not frame.is_whole:
            self._dropped[BROKEN] += 1
            return self.tick(clock)
        self.feed()
        result: FrameResult = self.perception.on_frame(frame, now_s)
        self._basis = replace(self._basis, taken_t_mono_s=now_s, ground=self._ground is not None)
        return self._tell(result, clock(), self._basis)

    def tick(self, clock: Callable[[], float], *, feed: bool = False) -> Outcome[PerceptionStatus]:
        """A second without a frame. ``feed``: frames have stopped, so that states need not wait for the next one."""
        if feed:
            self.feed()
        result: FrameResult = self.perception.on_tick(clock())
        return self._tell(result, clock(), None)

    def _tell(self, result: FrameResult, done_s: float, basis: Basis | None) -> Outcome[PerceptionStatus]:
        dropped = Counter(self.perception.dropped) + self._dropped
        return self._teller.outcome(
            result,
            self.perception,
            self.where,
            dropped=dropped,
            done_s=done_s,
            basis=basis,
            conflict=self.conflict,
            clear_count=self.settings.clear_count,
        )

    # What is known

    def feed(self) -> None:
        """Everything that waits, in the order of its own times. Every frame does so first."""
        waiting = sorted(self._waiting, key=itemgetter(0))
        self._waiting.clear()  # before anything in it can fail: the next frame must not meet it again
        for _, item in waiting:
            if isinstance(item, SlamPose):
                self.perception.feed_camera(item)
                self._basis = replace(self._basis, camera_t_mono_s=item.t_mono_s)
            else:
                self._feed_state(item)
        if self.flown.update(self.where.origin, self.where.position):
            self.perception.set_line(self.flown.points_enu)

    def _feed_state(self, state: VehicleState) -> None:
        self._basis = replace(self._basis, vehicle_t_utc_s=max(state.t_utc_s, self._basis.vehicle_t_utc_s))
        had_home = self.where.origin is not None
        if self.where.on_state(state):
            self._ground = None
            if had_home:
                self._begin_afresh("There is another home: the map begins afresh.")
        if state.armed and not self._armed:
            self._begin_afresh("A new flight: the map begins afresh.")
        self._armed = state.armed
        self.flown.mode = state.mode
        self.perception.set_flying(is_flying(state))
        self._feed_pose(state)

    def _feed_pose(self, state: VehicleState) -> None:
        t_s, position = state.position_t_mono_s, self.where.position_enu_m(state)
        if t_s is not None and position is not None and t_s != self._position_t_s:
            self._position_t_s = t_s
            self.perception.feed_position(t_s, position, velocity_enu_m_s(state), has_fix=has_fix(state))
        t_s = state.attitude_t_mono_s
        roll, pitch, heading = state.roll_rad, state.pitch_rad, state.heading_rad
        if t_s is None or roll is None or pitch is None or heading is None or t_s == self._attitude_t_s:
            return
        self._attitude_t_s = t_s
        self.perception.feed_attitude(t_s, roll, pitch, heading)

    def _begin_afresh(self, why: str) -> None:
        """A new perception: poses, camera path and alerts are of the flight before, too."""
        self._teller.ended += self.perception.alerts.end_all(self._basis.taken_t_mono_s)
        self.begun += 1
        self._position_t_s = self._attitude_t_s = -math.inf
        self.perception = self._made()
        self._teller.begun = why

    def _made(self) -> Any:
        made = self.kind.make(
            self.kind.settings(self.settings), alert_prefix=f"{self.kind.sensor}-{self._run}-{self.begun}"
        )
        made.set_ground(self._ground)
        made.set_line(self.flown.points_enu)
        return made
