"""The clearance certificate: proof that a flown line keeps its distance from a surface model.

The certificate is of a tube, not of a line. The required clearance holds a term for how far the autopilot departs
from the line (``ClearanceParams.following_m``); a point within that distance of the line is at most that much nearer
to any column, so that the rest of the requirement holds for every point of the tube.

The proof uses none of the code that makes the safe surface. Every cell of the file, at its full
resolution, is a solid column from below up to its elevation over the quadrilateral that it covers in the
model's CRS; unknown cells and everything outside are columns of infinite height; the line is straight
between its points in the model's CRS.
"""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import numpy as np
from pyproj import Proj

from mapping.geometry.arrays import F64
from mapping.version import __version__
from planning.basics.plan_model import FlownLine
from planning.certificate.as_json import certificate_json
from planning.certificate.certificate_model import (
    Certificate,
    ClearanceParams,
    HomeStand,
    LegClearance,
    Reason,
    WorstPoint,
    with_accuracy,
)
from planning.certificate.fenced import fence_reason, fence_verdict, rally_reasons
from planning.certificate.home_ground import FREE_SLOPE, FREE_STEP_M
from planning.certificate.home_stand import better_home, ground_at, ground_at_home, home_stand, lowered
from planning.certificate.line_heights import height_range
from planning.certificate.nearest import nearest_distances, threads_for
from planning.certificate.pyramid import MaxPyramid, cells_pyramid
from planning.certificate.reasons import (
    height_reason,
    home_reason,
    landing_reason,
    line_reasons,
    near_return_reason,
    return_reason,
    scale_reason,
)
from planning.certificate.returns import NEAR_M, SLOPE
from planning.certificate.unjudged import unjudged_reasons
from planning.certificate.ways_home import distance_flown, near_return, places_along, return_height
from planning.errors import MissionError, ParameterError
from planning.terrain.cells.cells import Layout
from planning.terrain.dsm import SCALE_TOLERANCE, Dsm, SurfaceModel, true_cells

__all__ = ["certificate_json", "certify"]


LONGEST_LINE_M = 100_000.0
"""Farther than any battery: a longer line is a mistaken coordinate."""


def certify(
    dsm: Dsm,
    line: FlownLine,
    params: ClearanceParams,
    *,
    ground: SurfaceModel | None = None,
    trend_step_m: float = 1.0,
    assumptions: dict[str, object] | None = None,
) -> Certificate:
    """Certificate of a flown line against the whole of a surface model, both in its CRS and vertical datum, metres.

    ``ground`` is the model before its small holes were filled, if it had any: home and landing are judged on it,
    for a filled hole has the height of its rim's highest cell, maybe a wall's, and heights would be counted from it.
    It may be the whole of a model of which ``dsm`` is a part: a better home is looked for farther around.
    ``assumptions`` are added to those written down here. Distances are exact to the rounding of float64.
    Raises ParameterError on a clearance, radius or step that is no positive number and MissionError on
    a line with a point that is not finite.
    """
    _check(line, params, trend_step_m)
    params = with_accuracy(params, dsm)
    with threads_for(dsm.cells.elevation_m.size):
        certificate = _judged(dsm, dsm if ground is None else ground, line, params, trend_step_m)
    return replace(certificate, assumptions=certificate.assumptions | (assumptions or {}))


def _judged(
    dsm: Dsm, ground: SurfaceModel, line: FlownLine, params: ClearanceParams, trend_step_m: float
) -> Certificate:
    cells = true_cells(dsm, line.points_m[:, :2])
    layout, pyramid = cells.layout, cells_pyramid(cells)
    points_m = layout.in_frame(line.points_m)
    start_m, end_m = points_m[:-1], points_m[1:]
    distance_m, share = nearest_distances(pyramid, start_m, end_m)
    lowest_m, highest_m = height_range(pyramid, start_m, end_m)
    if dsm.lowest_m is not None:  # heights that were raised would make the line seem lower above the ground
        lowest = cells.with_elevation(np.ascontiguousarray(dsm.lowest_m))
        _, highest_m = height_range(cells_pyramid(lowest), start_m, end_m)
    legs = _legs(line, distance_m, share, lowest_m)
    worst = _worst_point(dsm, line, distance_m, share)
    trend_places, trend_s_m = places_along(line.points_m, trend_step_m)
    trend_places = layout.in_frame(trend_places)
    trend_m, _ = nearest_distances(pyramid, trend_places, trend_places)  # Melita 2020, fig. 11
    at_home = ground_at_home(ground, line.home_xy_m, params)
    stand = home_stand(at_home, line, params)
    low_line = lowered(line, stand)
    low_points_m = layout.in_frame(low_line.points_m)
    needed_m, needed_from = return_height(pyramid, layout, low_line, params)
    near_m, near_from = near_return(pyramid, layout, low_line, params)
    nearest_low = _nearest_low(pyramid, line, low_points_m, stand, distance_m)
    stand = _with_distance(stand, nearest_low)
    planned_m = float(distance_m.min())
    home_problem = home_reason(at_home, stand, nearest_low, planned_m, params)
    spare_m = planned_m - params.required_clearance_m
    if home_problem is not None and (spare_m >= 0.0 or at_home.obstacle is not None):
        stand = replace(stand, better=better_home(ground, line.home_xy_m, params, spare_m=spare_m))
        home_problem = home_reason(at_home, stand, nearest_low, planned_m, params)
    fence = fence_verdict(dsm, line, params)
    highest_leg = int(np.argmax(highest_m))
    scale = _scale(dsm, worst)
    too_near = not planned_m >= params.required_clearance_m
    worst_is_unknown = too_near and _is_unknown_near(pyramid, layout, worst, distance_m)
    found = [
        *unjudged_reasons(line),
        *line_reasons(legs, worst, params, worst_is_unknown=worst_is_unknown),
        home_problem,
        return_reason(needed_m, needed_from, dsm, params),
        near_return_reason(near_m, near_from, needed_m, dsm, params),
        landing_reason(_landing_obstacle(ground, line, params)),
        *rally_reasons(dsm, ground, pyramid, layout, low_line, params),
        fence_reason(fence),
        height_reason(float(highest_m[highest_leg]), highest_leg, int(line.leg_item[highest_leg]), params),
        scale_reason(scale, SCALE_TOLERANCE),
    ]
    reasons: tuple[Reason, ...] = tuple(reason for reason in found if reason is not None)
    return Certificate(
        certified=not reasons,
        min_distance_m=planned_m,
        min_vertical_m=float(lowest_m.min()),
        required_clearance_m=params.required_clearance_m,
        worst=worst,
        legs=legs,
        rtl_height_needed_m=needed_m,
        home_column_clear=at_home.obstacle is None,
        max_height_above_ground_m=float(highest_m.max()),
        reasons=reasons,
        trend_s_m=trend_s_m,
        trend_distance_m=trend_m,
        assumptions=_assumptions(dsm, line, params, scale),
        budget=params.budget,
        home=stand,
        fence=fence,
    )


def _check(line: FlownLine, params: ClearanceParams, trend_step_m: float) -> None:
    positive = {"The required clearance": params.required_clearance_m, "The trend's step": trend_step_m}
    if params.max_height_above_ground_m is not None:
        positive["The largest height above ground"] = params.max_height_above_ground_m
    for name, value in positive.items():
        if not 0.0 < value < math.inf:
            raise ParameterError(f"{name} is {value} m.", advice="It must be a positive number of metres.")
    at_least_zero = {
        "vehicle's radius": params.vehicle_radius_m,
        "position error": params.position_error_m,
        "following error": params.following_m,
    }
    for name, value in at_least_zero.items():
        if not 0.0 <= value < math.inf:
            raise ParameterError(f"The {name} is {value} m.", advice="It must be zero or a positive number of metres.")
    if not math.isfinite(params.rtl_height_m):
        raise ParameterError(f"The return height is {params.rtl_height_m} m.", advice="Give metres above home.")
    flown = np.append(line.points_m.ravel(), [*line.home_xy_m, line.home_alt_dsm_m])
    if len(line.points_m) < 2 or not np.isfinite(flown).all():
        raise MissionError("A flown line needs two points or more, all of them finite numbers, and a home.")
    length_m = float(np.linalg.norm(np.diff(line.points_m, axis=0), axis=1).sum())
    if length_m > LONGEST_LINE_M:
        raise MissionError(
            f"The line is {length_m / 1000:.0f} km long; at most {LONGEST_LINE_M / 1000:.0f} km are judged.",
            advice="Check that the mission belongs to this surface model.",
        )


def _legs(line: FlownLine, distance_m: F64, share: F64, lowest_m: F64) -> tuple[LegClearance, ...]:
    s_m = distance_flown(line.points_m)
    at_s_m = s_m[:-1] + share * np.diff(s_m)
    return tuple(
        LegClearance(k, int(line.leg_item[k]), float(distance_m[k]), float(lowest_m[k]), float(at_s_m[k]))
        for k in range(len(distance_m))
    )


def _worst_point(dsm: Dsm, line: FlownLine, distance_m: F64, share: F64) -> WorstPoint:
    leg = int(np.argmin(distance_m))
    a, b = line.points_m[leg], line.points_m[leg + 1]
    x, y, alt_dsm_m = a + share[leg] * (b - a)
    s_m = distance_flown(line.points_m)
    lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[x, y]]))[0]
    return WorstPoint(
        lat_deg=float(lat_deg),
        lon_deg=float(lon_deg),
        alt_rel_home_m=float(alt_dsm_m - line.home_alt_dsm_m),
        leg=leg,
        s_m=float(s_m[leg] + share[leg] * (s_m[leg + 1] - s_m[leg])),
        x_m=float(x),
        y_m=float(y),
        alt_dsm_m=float(alt_dsm_m),
    )


def _is_unknown_near(pyramid: MaxPyramid, layout: Layout, worst: WorstPoint, distance_m: F64) -> bool:
    """Whether a column of infinite height is what the worst point is near: then climbing does not help."""
    far_above = layout.in_frame(np.array([[worst.x_m, worst.y_m, 1e6]]))
    unknown_m, _ = nearest_distances(pyramid, far_above, far_above)
    return bool(unknown_m[0] <= distance_m.min() + 1e-6)


def _nearest_low(
    pyramid: MaxPyramid, line: FlownLine, low_points_m: F64, stand: HomeStand, distance_m: F64
) -> LegClearance:
    """The leg that comes nearest when the vehicle stands as low as it may at home."""
    low_m = distance_m
    if stand.drop_m > 0.0:
        low_m, _ = nearest_distances(pyramid, low_points_m[:-1], low_points_m[1:])
    leg = int(np.argmin(low_m))
    return LegClearance(leg, int(line.leg_item[leg]), float(low_m[leg]), math.nan, math.nan)


def _with_distance(stand: HomeStand, nearest: LegClearance) -> HomeStand:
    return replace(stand, min_distance_m=nearest.min_distance_m) if math.isfinite(stand.drop_m) else stand


def _landing_obstacle(ground: SurfaceModel, line: FlownLine, params: ClearanceParams) -> str | None:
    if line.landing_xy_m is None or line.landing_xy_m == line.home_xy_m:
        return None
    return ground_at(ground, line.landing_xy_m, params).obstacle


def _scale(dsm: Dsm, worst: WorstPoint) -> float:
    """The CRS's point scale farthest from 1 in any direction at the worst point; infinite where it is not defined."""
    factors = Proj(dsm.crs).get_factors(worst.lon_deg, worst.lat_deg)
    scales = (float(factors.tissot_semimajor), float(factors.tissot_semiminor))
    return max(scales, key=lambda scale: abs(scale - 1.0))


def _following_words(params: ClearanceParams) -> str:
    if params.budget is None:
        return "the line is flown exactly: no wind, no way round corners"
    return f"the vehicle stays within {params.following_m:.2f} m of the line; ways home begin and lead within that, too"


def _assumptions(dsm: Dsm, line: FlownLine, params: ClearanceParams, scale: float) -> dict[str, object]:
    return {
        "version": __version__,
        "dsm_sha256": dsm.sha256,
        "crs": dsm.crs.to_string() if dsm.crs.to_epsg() else dsm.crs.name,
        "crs_scale": scale,
        "vertical_datum": dsm.vertical_datum or "unknown",
        "resolution_m": dsm.resolution_m,
        "width_px": dsm.width_px,
        "height_px": dsm.height_px,
        "cells": (
            "solid columns over the file's own cells at full resolution;"
            " unknown cells and everything outside: infinitely high"
        ),
        "earth": (
            "straight lines in the model's projected CRS; distances on the ground where its metres are too short"
        ),
        "following": _following_words(params),
        "home_alt_dsm_m": line.home_alt_dsm_m,
        "home_height": (
            "the lowest cell within that reach, or what the vehicle tells better; returns, and the line once more,"
            " are judged from there"
        ),
        "takeoff_and_landing": "vertical columns, left out of the distances",
        "column_rule": (
            f"cells within vehicle radius + position error + {params.set_down_m + params.dsm_place_m:g} m of home are"
            " known, and those"
            f" within the vehicle's radius of each other differ by at most {FREE_STEP_M:g} m"
            f" or {FREE_SLOPE:.2f} of their distance"
        ),
        "return": (
            "from every place of the line: climb to the return height or keep a larger own height,"
            " then straight and level to home; close to home the climb is cut short (ArduPilot RTL_CONE_SLOPE"
            f" {SLOPE:g}, PX4 RTL_CONE_ANG 45 within {NEAR_M:g} m)"
        ),
        "parameters": {key: value for key, value in asdict(params).items() if key != "budget"},
        "notes": list(line.notes),
    }
