"""The mission as a line in the map frame, with the item that each of its legs flies to."""

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
from telemetry.topics.messages import PlanRecord
from telemetry.topics.obstacles import MapOrigin


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
        flown = flown_line(mission, _level(origin))
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
