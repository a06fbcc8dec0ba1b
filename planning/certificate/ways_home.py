"""Ways home from everywhere on a line: how high they must be, and which place asks for it."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import FlownLine
from planning.certificate.certificate_model import ClearanceParams
from planning.certificate.pyramid import MaxPyramid
from planning.certificate.returns import return_altitude, return_altitudes
from planning.terrain.cells.cells import Layout

RETURN_STEP_M = 0.5
"""Ways home are judged from pieces of the line at most this long; inside one, the lower altitude counts."""


def return_height(
    pyramid: MaxPyramid, layout: Layout, line: FlownLine, params: ClearanceParams
) -> tuple[float, F64 | None]:
    """Height above home that every way home needs, 0 when none needs any, and the place that needs it."""
    places_m, _ = places_along(line.points_m, RETURN_STEP_M)
    return _needed(pyramid, layout, line, places_m, places_m, params)


def near_return(
    pyramid: MaxPyramid, layout: Layout, line: FlownLine, params: ClearanceParams
) -> tuple[float, F64 | None]:
    """As `return_height`, regarding that close to home autopilots do not climb to the return height."""
    places_m, _ = places_along(line.points_m, RETURN_STEP_M)
    raised_m = places_m.copy()
    raised_m[:, 2] = return_altitudes(
        places_m, np.array(line.home_xy_m), line.home_alt_dsm_m, rtl_height_m=params.rtl_height_m, step_m=RETURN_STEP_M
    )
    return _needed(pyramid, layout, line, places_m, raised_m, params)


def _needed(
    pyramid: MaxPyramid, layout: Layout, line: FlownLine, places_m: F64, flown_m: F64, params: ClearanceParams
) -> tuple[float, F64 | None]:
    """Height above home, and the place, that returns flown at the altitudes of ``flown_m`` do not reach."""
    home_xy_m = layout.in_frame(np.array([line.home_xy_m]))[0]
    altitude_m, place = return_altitude(pyramid, layout.in_frame(flown_m), home_xy_m, params.required_clearance_m)
    if place < 0:
        return 0.0, None
    return max(0.0, altitude_m - line.home_alt_dsm_m), places_m[place]


def places_along(points_m: F64, step_m: float) -> tuple[F64, F64]:
    """Places at most ``step_m`` apart along the (K, 3) polyline, every vertex among them.

    Returns (M, 3) places and (M,) the horizontal distance flown up to each.
    """
    legs = np.diff(points_m, axis=0)
    parts = np.maximum(1, np.ceil(np.linalg.norm(legs, axis=1) / step_m)).astype(np.int64)
    leg = np.repeat(np.arange(len(legs)), parts)
    share = (np.arange(len(leg)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[leg]
    places = points_m[:-1][leg] + share[:, None] * legs[leg]
    s_m = distance_flown(points_m)
    along = s_m[:-1][leg] + share * np.diff(s_m)[leg]
    return np.vstack([places, points_m[-1:]]), np.append(along, s_m[-1])


def distance_flown(points_m: F64) -> F64:
    """(K,) horizontal distance from the first of (K, 3) points to each."""
    steps = np.hypot(*np.diff(points_m[:, :2], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])
