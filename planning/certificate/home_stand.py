"""Home as the certificate judges it: how low a vehicle may stand there, and where it had better stand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from planning.basics.plan_model import FlownLine
from planning.certificate.certificate_model import SET_DOWN_M, BetterHome, ClearanceParams, HomeStand
from planning.certificate.home_ground import HomeGround, home_ground
from planning.certificate.home_search import Standing, ground_around, nearest_standing
from planning.terrain.dsm import SurfaceModel

DROP_M = 0.3
"""What a better place may drop where the line has no clearance to spare."""


def ground_at(ground: SurfaceModel, xy_m: tuple[float, float], params: ClearanceParams) -> HomeGround:
    """The ground around a place of take-off or landing; ``ground`` is the model before holes were filled."""
    return _ground(ground, xy_m, params, None)


def ground_at_home(ground: SurfaceModel, home_xy_m: tuple[float, float], params: ClearanceParams) -> HomeGround:
    """As `ground_at`, but a height that the vehicle tells itself settles what it stands on."""
    known = params.home_known_dsm_m
    return _ground(ground, home_xy_m, params, None if known is None else known[0])


def _ground(
    ground: SurfaceModel, xy_m: tuple[float, float], params: ClearanceParams, stands_dsm_m: float | None
) -> HomeGround:
    centre_m = params.position_error_m + params.set_down_m + params.dsm_place_m
    radius_m = params.vehicle_radius_m
    return home_ground(
        ground_around(ground, xy_m, centre_m + radius_m),
        xy_m,
        centre_m=centre_m,
        radius_m=radius_m,
        stands_dsm_m=stands_dsm_m,
    )


def home_stand(found: HomeGround, line: FlownLine, params: ClearanceParams) -> HomeStand:
    """Its ``min_distance_m`` is not known yet."""
    known = params.home_known_dsm_m
    low_m, high_m = (found.low_dsm_m, found.high_dsm_m) if known is None else known
    return HomeStand(
        alt_dsm_m=line.home_alt_dsm_m,
        low_dsm_m=low_m,
        high_dsm_m=high_m,
        drop_m=max(0.0, line.home_alt_dsm_m - low_m) if math.isfinite(low_m) else math.nan,
        reach_m=found.reach_m,
        told_by="model" if known is None else "vehicle",
        min_distance_m=math.nan,
    )


def lowered(line: FlownLine, stand: HomeStand) -> FlownLine:
    """The line as flown by a vehicle that stands as low as it may; the line itself where that is not known."""
    if not stand.drop_m > 0.0:
        return line
    down_m = stand.drop_m
    return replace(
        line,
        points_m=line.points_m - np.array([0.0, 0.0, down_m]),
        home_alt_dsm_m=line.home_alt_dsm_m - down_m,
        takeoff_alt_dsm_m=line.takeoff_alt_dsm_m - down_m,
    )


def better_home(
    ground: SurfaceModel, home_xy_m: tuple[float, float], params: ClearanceParams, *, spare_m: float
) -> BetterHome | None:
    """The nearest place to stand for a line that has ``spare_m`` more clearance than it needs.

    A line that is lower by d is nearer to the surface by d at most. Without such a place, the most level one.
    """
    most_drop_m = spare_m if spare_m > 0.0 else DROP_M
    near, level = nearest_standing(
        ground,
        home_xy_m,
        centre_m=params.position_error_m + max(params.set_down_m, SET_DOWN_M) + params.dsm_place_m,
        radius_m=params.vehicle_radius_m,
        most_drop_m=most_drop_m,
    )
    found = near or level
    return None if found is None else _placed(ground, home_xy_m, found, does=near is not None)


def _placed(ground: SurfaceModel, home_xy_m: tuple[float, float], found: Standing, *, does: bool) -> BetterHome:
    (lat_deg, lon_deg), (home_lat_deg, home_lon_deg) = ground.lat_lon_from_xy(np.array([found.xy_m, home_xy_m]))
    east = (lon_deg - home_lon_deg) * math.cos(math.radians(home_lat_deg))
    return BetterHome(
        lat_deg=float(lat_deg),
        lon_deg=float(lon_deg),
        away_m=found.away_m,
        bearing_deg=math.degrees(math.atan2(east, lat_deg - home_lat_deg)) % 360.0,
        drop_m=found.drop_m,
        does=does,
    )
