"""The mission as a line in the map frame, as planned and at the height at which it is flown right now."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from affine import Affine
from pyproj import CRS

from mapping.geometry.arrays import F64
from mapping.geometry.frames import EQUATOR_M
from planning.errors import PlanningError
from planning.formats.wpl import read_wpl
from planning.missions.flown import flown_line
from planning.terrain.dsm import Dsm
from telemetry.topics.messages import FlightStatus, PlanRecord
from telemetry.topics.obstacles import AvoidanceStatus, MapOrigin

_FLOWN_MODES = frozenset({"AUTO", "MISSION"})
_FLOWN_PHASES = frozenset({"taking_off", "flying", "paused"})
_RAISED = frozenset({"climbing", "offset", "ceiling"})
_STEP_M = 0.5


@dataclass(frozen=True, slots=True)
class FlightLine:
    points_enu: F64
    """(K, 3) from the top of the take-off to the last waypoint"""
    leg_item: tuple[int, ...]
    """(K - 1,) 1 is the mission's first item"""


def mission_line(plan: PlanRecord, origin: MapOrigin) -> FlightLine | None:
    """As the vehicle will fly it; None for a mission that is no line."""
    try:
        mission = read_wpl(plan.mission_wpl, plan.name)
        flown = flown_line(mission, _level(origin), begins_in_air=plan.taken_up)
    except PlanningError:
        return None
    if len(flown.points_m) < 2:
        return None
    points = flown.points_m - [0.0, 0.0, flown.home_alt_dsm_m]
    return FlightLine(points, tuple(int(item) + 1 for item in flown.leg_item))


def local_crs(origin: MapOrigin) -> CRS:
    """East and north of the map frame as a projection that any program knows: centimetres within some kilometres."""
    scale = 1.0 + origin.alt_amsl_m / EQUATOR_M
    return CRS.from_proj4(
        f"+proj=tmerc +lat_0={origin.lat_deg!r} +lon_0={origin.lon_deg!r} +k={scale!r} +x_0=0 +y_0=0 "
        "+ellps=WGS84 +towgs84=0,0,0 +units=m +no_defs"
    )


def _level(origin: MapOrigin) -> Dsm:
    """Level ground around home, whose coordinates are the map's."""
    return Dsm(np.zeros((1, 1), np.float32), Affine(1.0, 0.0, -0.5, 0.0, -1.0, 0.5), local_crs(origin), None, "")


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
