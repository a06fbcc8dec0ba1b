"""The mission ahead against the map as it is by now: the first place that comes too near to something seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from mapping.geometry.polyline import along_m
from mapping.perceiving.corridor import MissionLine
from planning.evading.columns import REACH_UP
from planning.evading.seen import conflicts
from telemetry.perception.convert import frame_of
from telemetry.perception.mission_line import FlightLine
from telemetry.topics.deltas import FoldedMap
from telemetry.topics.obstacles import MapDelta, MapOrigin, MissionConflict, ObstacleAlert, Sensor

EVERY_S = 1.0
_SLOWEST_M_S = 0.3
_OVER_AFTER = 2
"""Looks in a row that find nothing."""


class Flight(NamedTuple):
    """What the look ahead needs to know of the vehicle."""

    line: FlightLine
    origin: MapOrigin
    position_enu_m: tuple[float, float, float]
    speed_m_s: float
    radius_m: float
    reach_up: float = REACH_UP
    """``planning.evading.columns``: of the radar's gate."""


class Ahead:
    """Keeps a map of its own, added up of what is told, so that it never waits for the one that frames go into."""

    def __init__(self, sensor: Sensor, *, run: str) -> None:
        self._sensor: Sensor = sensor
        self._run = run
        self._map = FoldedMap()
        self._line: tuple[FlightLine | None, MissionLine | None] = (None, None)
        self._number = 0
        self._open: MissionConflict | None = None
        self._missed = 0

    def look(self, deltas: Sequence[MapDelta], flight: Flight | None) -> MissionConflict | None:
        """With these changes since the last time. Takes as long as it takes: for a thread of its own."""
        self._map = self._map.folded(deltas)
        if flight is None or self._map.last is None or self._map.last.origin != flight.origin:
            return None
        if self._line[0] is not flight.line:
            self._line = (flight.line, MissionLine(flight.line.points_enu))
        line = self._line[1]
        position = np.array(flight.position_enu_m)
        place = None if line is None else line.place(position)
        if line is None or place is None:
            return None
        seen = self._map.voxels.occupied(include_explained=False)
        edge_m = self._map.last.resolution_m
        found = conflicts(
            line.ahead(place.s_m, math.inf),
            (seen.keys.astype(np.float64) + 0.5) * edge_m,
            resolution_m=edge_m,
            radius_m=flight.radius_m,
            standing_from_enu_m=position if self._sensor == "radar" else None,
            reach_up=flight.reach_up,
        )
        if found is None:
            return None
        lat_deg, lon_deg, _ = (float(v) for v in frame_of(flight.origin).to_geodetic([found.enu_m])[0])
        east, north, up = (float(v) for v in found.enu_m)
        return MissionConflict(
            ahead_m=float(found.ahead_m),
            time_s=None if flight.speed_m_s < _SLOWEST_M_S else float(found.ahead_m) / flight.speed_m_s,
            item=_item(flight.line, place.s_m + found.ahead_m),
            distance_m=float(found.distance_m),
            enu_m=(east, north, up),
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            voxels=int(found.voxels),
            top_unseen=found.top_unseen,
        )

    def alerts(
        self, conflict: MissionConflict | None, t_mono_s: float, t_utc_s: float, done_s: float
    ) -> list[ObstacleAlert]:
        """What is to be told after a look: one conflict at a time, from when it is seen until it is not there twice."""
        if conflict is None:
            self._missed += 1
            if self._open is None or self._missed < _OVER_AFTER:
                return []
            self._open = None
            return [self._alert("ends", f"{self._sensor}: the mission ahead is clear", t_mono_s, t_utc_s, done_s)]
        self._missed = 0
        phase = "begins" if self._open is None else "goes_on"
        self._number += self._open is None
        self._open = conflict
        return [self._alert(phase, _words(self._sensor, conflict), t_mono_s, t_utc_s, done_s)]

    def _alert(
        self, phase: Literal["begins", "goes_on", "ends"], text: str, t_mono_s: float, t_utc_s: float, done_s: float
    ) -> ObstacleAlert:
        name = f"{self._sensor}-{self._run}-ahead-{self._number}"
        return ObstacleAlert(name, self._sensor, "conflict", phase, t_mono_s, t_utc_s, done_s, text)


def _item(line: FlightLine, s_m: float) -> int:
    leg = int(np.searchsorted(along_m(line.points_enu)[1:], s_m))
    return line.leg_item[min(leg, len(line.leg_item) - 1)]


def _words(sensor: Sensor, conflict: MissionConflict) -> str:
    when = "" if conflict.time_s is None else f", reached in {conflict.time_s:.0f} s"
    what = "an obstacle whose top is not seen" if conflict.top_unseen else "an obstacle"
    return (
        f"{sensor}: the mission comes within {conflict.distance_m:.1f} m of {what}, "
        f"{conflict.ahead_m:.0f} m ahead on the way to item {conflict.item}{when}"
    )
