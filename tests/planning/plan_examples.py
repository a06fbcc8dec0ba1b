"""A part of the demo terrain small enough for slow oracles, and requests over it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from planning.basics.plan_model import PathParams, Poi, SurfaceParams, VehicleProfile
from planning.ground.demo_hillside import demo_dsm
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm

QUAD = VehicleProfile("quad", rtl_height_m=60.0, position_error_m=0.5)
PLAN_FILES = {
    "trajectory.csv", "trajectory.kml", "mission.waypoints", "mission.plan", "mission.geojson", "certificate.json",
    "report.html",
}  # fmt: skip
"""What a finished plan is exported as, all of it."""


@lru_cache
def small_dsm() -> Dsm:
    """100 x 100 cells of 0.5 m beside the ruin, rough and all known."""
    return demo_dsm().window(620, 430, 100, 100)


def pois_at(dsm: Dsm, shares: list[tuple[float, float]], **fields: float) -> tuple[Poi, ...]:
    """Points at shares (east, north) of the model's sides."""
    west, south, east, north = dsm.bounds_m
    xy_m = np.array([(west + a * (east - west), south + b * (north - south)) for a, b in shares])
    return tuple(
        Poi(float(lat), float(lon), f"P{k + 1}", **fields) for k, (lat, lon) in enumerate(dsm.lat_lon_from_xy(xy_m))
    )


def request_over(dsm: Dsm, shares: list[tuple[float, float]], **fields: object) -> PlanRequest:
    request = PlanRequest(
        pois=pois_at(dsm, shares), profile=QUAD, surface=SurfaceParams(8.0, 4.0), path=PathParams(step_m=0.2)
    )
    return PlanRequest(**{name: getattr(request, name) for name in PlanRequest.__dataclass_fields__} | fields)  # type: ignore[arg-type]
