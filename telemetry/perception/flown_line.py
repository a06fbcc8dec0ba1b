"""The mission that is being flown right now, at the height at which it is flown."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.perception.mission_line import FlightLine, mission_line
from telemetry.topics.messages import FlightStatus, PlanRecord
from telemetry.topics.obstacles import AvoidanceStatus, MapOrigin

_FLOWN_MODES = frozenset({"AUTO", "MISSION"})
_FLOWN_PHASES = frozenset({"taking_off", "flying", "paused"})
_RAISED = frozenset({"climbing", "offset", "ceiling"})
_STEP_M = 0.5


class FlownLine:
    """Of the plan on board, while it is flown; raised while avoidance flies it higher, or the way ahead would seem
    to lead through what the vehicle is passing over."""

    def __init__(self) -> None:
        self.plan: PlanRecord | None = None
        self.flight = FlightStatus()
        self.avoidance = AvoidanceStatus()
        self.mode = ""
        self.line: FlightLine | None = None
        self._asked: tuple[object, ...] = ()
        self._planned: tuple[object, FlightLine | None] = ((), None)

    @property
    def points_enu(self) -> F64 | None:
        return None if self.line is None else self.line.points_enu

    def update(self, origin: MapOrigin | None, position_enu_m: tuple[float, float, float] | None) -> bool:
        """Whether the line has become another one."""
        offset_m = self._offset_m(position_enu_m)
        asked = (self.plan, origin, self._is_flown(), offset_m)
        if asked == self._asked:
            return False
        self._asked = asked
        self.line = self._line(origin, offset_m) if self._is_flown() else None
        return True

    def _is_flown(self) -> bool:
        own = self.flight.way != "none" and self.flight.phase in _FLOWN_PHASES
        return self.plan is not None and (own or self.mode in _FLOWN_MODES)

    def _offset_m(self, position_enu_m: tuple[float, float, float] | None) -> float:
        if self.avoidance.state not in _RAISED:
            return 0.0
        offset_m = self.avoidance.height_offset_m
        if self.avoidance.state == "climbing" and position_enu_m is not None and self._planned[1] is not None:
            offset_m = max(offset_m, position_enu_m[2] - _height_beside(self._planned[1].points_enu, position_enu_m))
        return np.floor(offset_m / _STEP_M) * _STEP_M

    def _line(self, origin: MapOrigin | None, offset_m: float) -> FlightLine | None:
        if self.plan is None or origin is None:
            return None
        if self._planned[0] != (self.plan, origin):
            self._planned = ((self.plan, origin), mission_line(self.plan, origin))
        planned = self._planned[1]
        return (
            None
            if planned is None
            else FlightLine(planned.points_enu + np.array([0.0, 0.0, offset_m]), planned.leg_item)
        )


def _height_beside(points_enu: F64, position_enu_m: tuple[float, float, float]) -> float:
    """Of the line at its nearest place to the position, as seen from above."""
    a, b, p = points_enu[:-1], points_enu[1:], np.array(position_enu_m)
    d = b - a
    flat_sq = np.maximum((d[:, :2] ** 2).sum(axis=1), 1e-9)
    share = np.clip(((p[:2] - a[:, :2]) * d[:, :2]).sum(axis=1) / flat_sq, 0.0, 1.0)
    places = a + share[:, None] * d
    return float(places[np.argmin(np.linalg.norm(places[:, :2] - p[:2], axis=1)), 2])
