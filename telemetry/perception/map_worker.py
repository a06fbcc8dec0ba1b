"""What the thread of a perception node does beside its frames: tells the map's changes, shows frames, looks ahead."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from mapping.sensor_frames import SensorFrame
from mapping.voxels.map import VoxelMap
from telemetry.perception.ahead import Flight
from telemetry.perception.frame_worker import (
    AVOIDANCE,
    CAMERA,
    CONFLICT,
    FLIGHT,
    TICK_S,
    WHOLE,
    FrameWorker,
    Give,
)
from telemetry.perception.inbox import Inbox
from telemetry.perception.map_changes import ChangeTeller
from telemetry.perception.perceiver import GroundWanted, Perceiver
from telemetry.perception.sensor_kinds import SensorKind
from telemetry.perception.showing import Showing
from telemetry.perception.status import Outcome
from telemetry.topics.obstacles import MapDelta, MapOrigin, PerceptionStatus

DELTA_S = 0.1
FLIGHT_DELTA_S = 1.0
"""The map of the whole flight is for looking at: what one voxel goes through in a second is told once."""
LOOK_S = 1.0


class MapWorker(FrameWorker):
    """Of one sensor's map, regions and alerts."""

    def __init__(
        self,
        kind: SensorKind,
        inbox: Inbox,
        *,
        give: Give,
        tell_map: Callable[[list[MapDelta]], None],
        tell_flight_map: Callable[[list[MapDelta]], None],
        ask_ground: Callable[[GroundWanted], None],
        look_ahead: Callable[[Flight | None], None],
        run: str,
        clock: Callable[[], float] = time.monotonic,
        utc: Callable[[], float] = time.time,
    ) -> None:
        utc_minus_mono_s = utc() - clock()
        perceiver = Perceiver(kind, run=run, utc_minus_mono_s=utc_minus_mono_s)
        super().__init__(perceiver, inbox, status=kind.status, give=give, ask_ground=ask_ground, clock=clock)
        self._kind, self._look_ahead = kind, look_ahead
        self._tell_map, self._tell_flight_map = tell_map, tell_flight_map
        self._changes = ChangeTeller(kind.sensor, utc_minus_mono_s)
        self._flight_changes = ChangeTeller("vision_flight", utc_minus_mono_s)
        self._delta_s = self._flight_delta_s = self._looked_s = clock()
        self._showing = Showing(utc_minus_mono_s)
        self._frame_t_s = 0.0
        self._handlers = {
            **self._handlers,
            CAMERA: perceiver.on_camera,
            FLIGHT: self._on_flight,
            AVOIDANCE: self._on_avoidance,
            WHOLE: self._on_whole,
            CONFLICT: self._on_conflict,
        }

    def _due_s(self) -> float:
        return min(self._told_s + TICK_S, self._delta_s + DELTA_S)

    def _work(self, frame: SensorFrame) -> Outcome[PerceptionStatus]:
        self._frame_t_s = frame.t_mono_s
        return self.perceiver.work(frame, self._clock)

    def _tick(self) -> Outcome[PerceptionStatus]:
        return self.perceiver.tick(self._clock, feed=True)

    def _once_told(self, frame: SensorFrame) -> None:
        self._tell_changes()
        self.perceiver.perception.accumulate()

    def _beside(self, now_s: float) -> None:
        self._tell_changes()
        self._tell_flight_changes(now_s)
        self._show(now_s)
        if now_s >= self._looked_s + LOOK_S:
            self._looked_s = now_s
            self._look_ahead(self._flight())

    def _flight(self) -> Flight | None:
        """None while no mission is flown."""
        where, line, settings = self.perceiver.where, self.perceiver.flown.line, self.perceiver.settings
        if where.origin is None or where.position is None or line is None or settings.paper_bare:
            return None
        if not self.perceiver.perception.placed:
            return None
        radius_m = settings.vehicle_radius_m + settings.position_error_m
        reach_up = math.tan(math.radians(settings.radar_high_deg))
        return Flight(line, where.origin, where.position, where.speed_m_s, radius_m, reach_up)

    def _tell_changes(self) -> None:
        now_s = self._clock()
        if now_s < self._delta_s + DELTA_S:
            return
        deltas = self._changed(self._changes, self.perceiver.perception.map, now_s)
        self._delta_s = now_s
        if deltas:
            self._tell_map(deltas)

    def _tell_flight_changes(self, now_s: float) -> None:
        flight = self.perceiver.perception.flight
        if flight is None or now_s < self._flight_delta_s + FLIGHT_DELTA_S:
            return
        self._flight_delta_s = now_s
        if deltas := self._changed(self._flight_changes, flight.map, now_s):
            self._tell_flight_map(deltas)

    def _changed(self, teller: ChangeTeller, the_map: VoxelMap, now_s: float) -> list[MapDelta]:
        cleared = self.perceiver.settings.clear_count
        return teller.changes(the_map, self._origin, self._frame_t_s or now_s, cleared)

    def _show(self, now_s: float) -> None:
        """What the newest frame showed, if there was one since."""
        if self._kind.looks is None:
            return
        if (look := self._showing.due(self.perceiver.perception, self._origin, now_s)) is not None:
            self._give(self._kind.looks, look)

    @property
    def _origin(self) -> MapOrigin | None:
        """None while nobody knows where the maps lie."""
        return self.perceiver.where.origin if self.perceiver.perception.placed else None

    def _on_flight(self, message: Any) -> None:
        self.perceiver.flown.flight = message

    def _on_avoidance(self, message: Any) -> None:
        self.perceiver.flown.avoidance = message

    def _on_whole(self, done: Callable[[], None]) -> None:
        self._changes.forget()
        self._flight_changes.forget()
        self._delta_s = self._clock() - DELTA_S
        self._flight_delta_s = self._clock() - FLIGHT_DELTA_S
        self._tell_changes()
        self._tell_flight_changes(self._clock())
        done()

    def _on_conflict(self, message: Any) -> None:
        self.perceiver.conflict = message
