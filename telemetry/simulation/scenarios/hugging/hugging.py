"""A terrain-hugging mission over a surface model, planned as any other, and its line in the scenario's frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import length_m
from planning.basics.plan_model import Mission, PathParams, Poi, SurfaceParams
from planning.errors import ParameterError
from planning.missions.vehicle_profile import load_profile
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm
from telemetry.simulation.simulator.neu_frame import NeuFrame

HEIGHT_M, RADIUS_M = 5.0, 20.0
"""H and R = 4 H, the defaults of Melita 2020."""
SPEED_M_S, FASTEST_M_S = 3.0, 5.0
RIM_M = 12.0
"""Points keep this far from the model's rim and from unknown cells."""
LEAST_APART_M = 40.0
TRIES = 2000


@dataclass(frozen=True, slots=True)
class Hugging:
    dsm: Dsm
    mission: Mission
    frame: NeuFrame
    line_enu_m: F64
    """(K, 3) From the top of the take-off to the last waypoint; up counts from home."""
    clearance_m: float
    """Smallest distance from the line to any of the model's cells, as certified."""

    @property
    def length_m(self) -> float:
        return length_m(self.line_enu_m[:, :2])


def hugging(dsm: Dsm, pois: tuple[Poi, ...]) -> Hugging:
    """Raises what planning raises."""
    request = PlanRequest(
        pois=pois,
        profile=load_profile("mapper-rtk"),
        surface=SurfaceParams(RADIUS_M, HEIGHT_M),
        path=PathParams(mean_speed_m_s=SPEED_M_S, max_speed_m_s=FASTEST_M_S),
    )
    plan = plan_mission(dsm, request)
    home = plan.mission.home
    frame = NeuFrame(home.lat_deg, home.lon_deg, home.alt_dsm_m)
    lat_lon = plan.dsm.lat_lon_from_xy(plan.line.points_m[:, :2])
    north_per_deg, east_per_deg = frame.metres_per_degree
    line = np.column_stack(
        [
            (lat_lon[:, 1] - home.lon_deg) * east_per_deg,
            (lat_lon[:, 0] - home.lat_deg) * north_per_deg,
            plan.line.points_m[:, 2] - home.alt_dsm_m,
        ]
    )
    return Hugging(plan.dsm, plan.mission, frame, line, plan.certificate.min_distance_m)


def random_route(dsm: Dsm, random: np.random.Generator, *, points: int, apart_m: float) -> tuple[Poi, ...]:
    """Points on known ground, each ``apart_m`` or more from the one before, or less on a small model.

    Raises ParameterError where not even ``LEAST_APART_M`` is to be had.
    """
    route = _places(dsm, random, points, apart_m)
    while len(route) < points and apart_m > LEAST_APART_M:
        apart_m = max(0.75 * apart_m, LEAST_APART_M)
        route = _places(dsm, random, points, apart_m)
    if len(route) < points:
        raise ParameterError(
            f"The surface model has no room for a route of {points} points {LEAST_APART_M:.0f} m apart, "
            f"{RIM_M:.0f} m from its rim and from unknown cells.",
            where="surface model",
            advice="Give a larger one.",
        )
    lat_lon = dsm.lat_lon_from_xy(np.array(route))
    return tuple(Poi(float(lat), float(lon), f"P{number}") for number, (lat, lon) in enumerate(lat_lon, start=1))


def _places(dsm: Dsm, random: np.random.Generator, points: int, apart_m: float) -> list[F64]:
    """(x, y) of as many as were found."""
    west, south, east, north = dsm.bounds_m
    low, high = np.array([west, south]) + RIM_M, np.array([east, north]) - RIM_M
    route: list[F64] = []
    if (high <= low).any():
        return route
    for _ in range(TRIES):
        place = random.uniform(low, high)
        far = not route or np.hypot(*(place - route[-1])) >= apart_m
        if far and _all_known(dsm, place):
            route.append(place)
        if len(route) == points:
            break
    return route


def _all_known(dsm: Dsm, place: F64) -> bool:
    """Around the place, as far as the rim."""
    steps = np.arange(-RIM_M, RIM_M + 0.1, 2.0)
    around = place + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return bool(np.isfinite(dsm.elevation_at(around)).all())
