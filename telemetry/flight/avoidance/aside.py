"""Steps aside by itself: along the mission at every frame anew, past what the tracks say, and back onto its line.

Velocity obstacles (Wessendorp 2021, III-C) in the link node: tracks, ground and limits come from the tracks node, the
mission's line from what is left of the flight. Sans-IO; a place is all that is ever ordered, a few seconds ahead: a
vehicle that hears nothing more stops there.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import moved_deg, offset_m
from mapping.perceiving.braking import Braking
from planning.evading.velocity_obstacles import Proposal
from telemetry.flight.avoidance.fence_aboard import FenceAboard
from telemetry.flight.avoidance.passing_tracks import (
    Scene,
    is_last_moment,
    is_wanted,
    scene_of,
    velocity_of,
    velocity_past,
)
from telemetry.flight.guided.helm import Helm, here_of, moved
from telemetry.mavlink.actions import Action
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.vehicle import VehicleState

OLD_S = 0.7
"""Tracks older than this say nothing about now."""
LEAD_S, LEAST_LEAD_M = 3.0, 2.0
"""So far ahead is the place that is ordered."""
CARROT_S, LEAST_CARROT_M = 3.0, 4.0
"""So far along the line ahead lies what it steers for."""
BACK_M, BACK_S = 0.7, 0.6
"""So near to the line and for so long with nothing in the way, it is handed back to it."""
PASSED_M = 0.7
STANDS_M_S, STUCK_S, GIVEN_UP_S = 0.2, 4.0, 20.0
SPEED_STEP_M_S = 0.25
"""Speeds are ordered in steps: every order waits for its answer."""
AGAIN_M, AGAIN_S = 0.25, 0.5
SAID_S = 3.0
"""So long it says that the fence was in the way."""


class Aside:
    """``wants`` says whether the way ahead leads into something; ``begin`` and ``look`` fly past it."""

    def __init__(self, helm: Helm, fence: FenceAboard) -> None:
        self._helm, self._fence = helm, fence
        self._fenced, self._fenced_s = "", -math.inf
        """Why it did not begin, and when that was."""
        self._tracks: TracksStatus | None = None
        self._room_m: tuple[float, ...] = ()
        self.settings = PerceptionSettings()
        self.why = ""
        """It stands: no velocity leads past, or nothing is seen any more."""
        self._line: list[F64] = []
        self._targets: tuple[GuidedTarget, ...] = ()
        self._origin = (0.0, 0.0)
        self._free_since_s: float | None = None
        self._given_up_s = -math.inf
        self._stands_since_s: float | None = None
        self._judged_t_s = -math.inf
        """Of the newest tracks that were acted on: each are looked at once, however often something else is new."""
        self._sent: tuple[float, float, float] | None = None
        self._sent_s = -math.inf

    def on_tracks(self, tracks: TracksStatus) -> None:
        if self._tracks is None or tracks.t_mono_s >= self._tracks.t_mono_s or tracks.state != "running":
            self._tracks = tracks

    def sees(self, now_s: float) -> bool:
        """Whether there are tracks of now, and known ground to keep off."""
        tracks = self._tracks
        return tracks is not None and tracks.state == "running" and now_s - tracks.t_mono_s <= OLD_S

    def why_not(self, now_s: float) -> str:
        """It could not step aside now; empty while it could."""
        if not self.sees(now_s):
            return "Objects are not followed at the moment: it climbs instead of stepping aside."
        if not self.knows_ground():
            return "No surface model is known here: it climbs instead of stepping aside."
        return f"{self._fenced} It does not step aside." if now_s - self._fenced_s <= SAID_S else ""

    def knows_ground(self) -> bool:
        return self._tracks is not None and bool(self._tracks.room_m)

    # On the way.

    def wants(self, state: VehicleState, targets: tuple[GuidedTarget, ...], now_s: float) -> bool:
        """Whether the velocity flown now, or the way to the next target, leads into something that can be passed."""
        if not (targets and self.sees(now_s) and self.knows_ground()) or state.lat_deg is None or not self._is_new():
            return False
        if now_s - self._given_up_s < GIVEN_UP_S:
            return False
        towards = _towards(state, targets[0])
        length_m = math.hypot(*towards)
        if length_m < PASSED_M:
            return False
        wanted = towards * (targets[0].speed_m_s / length_m)
        scene = self._scene(state, targets[0].speed_m_s, now_s)
        found = velocity_past(scene, wanted, velocity_of(state))
        if found is None or is_wanted(found, wanted):
            return False
        if math.hypot(*found.velocity_enu_m_s) < STANDS_M_S:
            return is_last_moment(scene, velocity_of(state))
        if fenced := self._beyond_fence(state, _lead(found)):
            self._fenced, self._fenced_s = fenced, now_s
        return not fenced

    def _is_new(self) -> bool:
        assert self._tracks is not None
        is_new, self._judged_t_s = self._tracks.t_mono_s != self._judged_t_s, self._tracks.t_mono_s
        return is_new

    def begin(self, state: VehicleState, targets: tuple[GuidedTarget, ...]) -> None:
        """The line to come back to begins here: at its targets' planned heights, or at the vehicle's own if higher."""
        assert state.lat_deg is not None
        assert state.lon_deg is not None
        self._origin = (state.lat_deg, state.lon_deg)
        self._targets, self.why, self._judged_t_s = targets, "", -math.inf
        here = np.array([0.0, 0.0, state.alt_rel_home_m or 0.0])
        self._line = [here, *(self._point(target) for target in targets)]
        self._free_since_s, self._sent, self._sent_s = None, None, -math.inf
        self._stands_since_s = None

    @property
    def left(self) -> tuple[GuidedTarget, ...]:
        return self._targets

    def is_back(self, now_s: float) -> bool:
        """On the line, with nothing in the way of it, for long enough; or past its end."""
        free_s = 0.0 if self._free_since_s is None else now_s - self._free_since_s
        return not self._targets or free_s >= BACK_S

    def look(self, state: VehicleState, now_s: float) -> list[Action]:
        """The next orders."""
        if not self.sees(now_s):
            return self._stand(state, "The radar's tracks have stopped: it holds.", now_s)
        if not self.knows_ground():
            return self._stand(state, "No surface model is known around it: it holds.", now_s)
        if not self._is_new():
            return []
        at = self._at(state)
        self._drop_passed(at)
        if not self._targets:
            return []
        carrot, aside_m = self._carrot(at, self._targets[0].speed_m_s)
        wanted = _with_speed(carrot[:2] - at[:2], self._targets[0].speed_m_s)
        found = velocity_past(self._scene(state, self._targets[0].speed_m_s, now_s), wanted, velocity_of(state))
        if found is None or math.hypot(*found.velocity_enu_m_s) < STANDS_M_S:
            return self._stand(state, "No velocity leads past: it holds. Resume goes on, or return home.", now_s)
        is_free = is_wanted(found, wanted)
        if not (is_free and aside_m <= BACK_M):
            self._free_since_s = None
        elif self._free_since_s is None:
            self._free_since_s = now_s
        offset = carrot[:2] - at[:2] if is_free else _lead(found)
        if fenced := self._beyond_fence(state, offset):
            return self._stand(state, f"{fenced} It holds. Resume goes on, or return home.", now_s)
        self.why, self._stands_since_s = "", None
        on_line = is_free and aside_m <= BACK_M
        return self._go(state, offset, float(carrot[2]), found, on_line=on_line, now_s=now_s)

    def give_up(self, now_s: float) -> None:
        """For a while it does not begin again: those who climb over what is ahead have their turn."""
        self._given_up_s = now_s

    def is_stuck(self, now_s: float) -> bool:
        """It has stood for so long that what moves would have passed."""
        return self._stands_since_s is not None and now_s - self._stands_since_s >= STUCK_S

    def _stand(self, state: VehicleState, why: str, now_s: float) -> list[Action]:
        """In GUIDED where it is in that already: it may go on with the next frame."""
        is_new = self._stands_since_s is None or self._sent is not None
        self.why, self._free_since_s, self._sent = why, None, None
        if self._stands_since_s is None:
            self._stands_since_s = now_s
        if state.mode != self._helm.guided_mode or not self.sees(now_s):
            return self._helm.stop(now_s)
        return self._helm.stop_in_guided(state, now_s, radius_m=LEAST_LEAD_M) if is_new else []

    def _beyond_fence(self, state: VehicleState, offset: F64) -> str:
        """Why the turn from where it flies now to a place would breach the fence; empty: it keeps inside."""
        assert state.lat_deg is not None
        assert state.lon_deg is not None
        here, velocity = (state.lat_deg, state.lon_deg), velocity_of(state)
        speed_m_s = math.hypot(*velocity)
        braking = Braking(self.settings.brake_decel_m_s2, self.settings.brake_jerk_m_s3)
        stops = _with_speed(velocity, braking.distance_m(speed_m_s))
        places = [moved_deg(here, float(east_m), float(north_m)) for east_m, north_m in (stops, offset)]
        return self._fence.why_not(state, (here, *places))

    def _go(
        self, state: VehicleState, offset: F64, carrot_m: float, found: Proposal, *, on_line: bool, now_s: float
    ) -> list[Action]:
        if state.mode != self._helm.guided_mode:
            return self._helm.change_mode(self._helm.guided_mode, now_s)
        speed_m_s, at = math.hypot(*found.velocity_enu_m_s), self._at(state)
        sent_m = self._sent[2] if self._sent and not on_line else -math.inf
        up_m = max(carrot_m, state.alt_rel_home_m or 0.0, sent_m)
        steps = max(1, math.ceil(speed_m_s / SPEED_STEP_M_S - 1e-6))
        actions = self._helm.set_speed(steps * SPEED_STEP_M_S, now_s)
        place = (float(at[0] + offset[0]), float(at[1] + offset[1]), up_m)
        if self._sent is not None and math.dist(place, self._sent) < AGAIN_M and now_s - self._sent_s < AGAIN_S:
            return actions
        self._sent, self._sent_s = place, now_s
        here = here_of(state)
        heading = math.atan2(offset[0], offset[1]) % math.tau if offset.any() else state.heading_rad
        goal = moved(here, float(offset[1]), float(offset[0]), up_m - here.alt_rel_home_m)
        return [*actions, *self._helm.go_to(replace(goal, heading_rad=heading), now_s, radius_m=LEAST_LEAD_M)]

    # Where things are.

    def _at(self, state: VehicleState) -> F64:
        """(3,) east, north and up of the vehicle, from where it began."""
        assert state.lat_deg is not None
        assert state.lon_deg is not None
        return np.array([*offset_m(self._origin, state.lat_deg, state.lon_deg), state.alt_rel_home_m or 0.0])

    def _point(self, target: GuidedTarget) -> F64:
        return np.array([*offset_m(self._origin, target.lat_deg, target.lon_deg), target.alt_rel_home_m])

    def _drop_passed(self, at: F64) -> None:
        """A target is passed once the vehicle is beside it, or beyond."""
        while self._targets:
            a, b = self._line[0], self._line[1]
            length_m = math.hypot(*(b - a)[:2])
            along_m = float((at - a)[:2] @ (b - a)[:2]) / length_m if length_m > 0.0 else math.inf
            if along_m < length_m - PASSED_M:
                return
            self._targets, self._line = self._targets[1:], self._line[1:]

    def _carrot(self, at: F64, speed_m_s: float) -> tuple[F64, float]:
        """A place on the present leg ahead of the vehicle, and how far beside the leg the vehicle is."""
        a, b = self._line[0], self._line[1]
        leg = b - a
        length_m = math.hypot(*leg[:2])
        along_m = max(0.0, float((at - a)[:2] @ leg[:2]) / length_m)
        beside_m = math.hypot(*(at - a - leg * (along_m / length_m))[:2])
        ahead_m = min(length_m, along_m + max(LEAST_CARROT_M, CARROT_S * speed_m_s))
        carrot = a + leg * (ahead_m / length_m)
        return np.array([carrot[0], carrot[1], max(a[2] + leg[2] * along_m / length_m, carrot[2])]), beside_m

    def _scene(self, state: VehicleState, speed_m_s: float, now_s: float) -> Scene:
        assert self._tracks is not None
        return scene_of(state, self._tracks, self.settings, speed_m_s=speed_m_s, now_s=now_s)


def _towards(state: VehicleState, target: GuidedTarget) -> F64:
    assert state.lat_deg is not None
    assert state.lon_deg is not None
    return np.array(offset_m((state.lat_deg, state.lon_deg), target.lat_deg, target.lon_deg))


def _lead(found: Proposal) -> F64:
    """(2,) To the place that is ordered."""
    velocity = np.array(found.velocity_enu_m_s)
    return velocity * max(LEAD_S, LEAST_LEAD_M / math.hypot(*velocity))


def _with_speed(direction: F64, speed_m_s: float) -> F64:
    length_m = math.hypot(*direction)
    return direction * (speed_m_s / length_m) if length_m > 1e-6 else np.zeros(2)
