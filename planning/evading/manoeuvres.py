"""Ways up, over and around what was seen, with the clearance of each.

Both papers avoid upwards or sideways and never downwards (Miccinesi 2022, fig. 9; Bigazzi 2022, figs 9-10).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from planning.evading.around import way_around
from planning.evading.keep_clear import Room, Seen, Surface
from planning.evading.line import LineAhead
from planning.evading.model import AvoidanceParams, Kind, Manoeuvre, NoWay
from planning.evading.over import way_over

__all__ = [
    "AvoidanceParams",
    "Manoeuvre",
    "NoWay",
    "Seen",
    "Surface",
    "around",
    "over",
]

BEYOND_M = 20.0
"""Distances are exact up to so much beyond what must be kept."""


def over(
    position_enu_m: ArrayLike,
    line_enu_m: ArrayLike,
    seen: Sequence[Seen],
    surface: Surface | None = None,
    params: AvoidanceParams | None = None,
) -> Manoeuvre | NoWay:
    """Straight up, then along the line ahead at the smallest offset that keeps clear of everything.

    ``position_enu_m`` (3,) the vehicle; ``line_enu_m`` (K, 3) the mission ahead from beside the vehicle on, K >= 2;
    ``seen`` the unexplained voxels of each map. Pure; a few milliseconds for ten thousand voxels near the line.
    """
    return _way("over", position_enu_m, line_enu_m, seen, surface, params or AvoidanceParams())


def around(
    position_enu_m: ArrayLike,
    line_enu_m: ArrayLike,
    seen: Sequence[Seen],
    surface: Surface | None = None,
    params: AvoidanceParams | None = None,
) -> Manoeuvre | NoWay:
    """Sideways past what was seen and back onto the line behind it; arguments as for ``over``."""
    return _way("around", position_enu_m, line_enu_m, seen, surface, params or AvoidanceParams())


def _way(
    kind: Kind,
    position_enu_m: ArrayLike,
    line_enu_m: ArrayLike,
    seen: Sequence[Seen],
    surface: Surface | None,
    params: AvoidanceParams,
) -> Manoeuvre | NoWay:
    position = np.asarray(position_enu_m, np.float64).reshape(3)
    line = LineAhead(np.asarray(line_enu_m, np.float64), params.ahead_m)
    if len(line.points_m) < 2 or not (np.isfinite(position).all() and np.isfinite(line.points_m).all()):
        return NoWay(kind, "There is no mission ahead.")
    reach_m = params.sideways_m + params.keep_m + BEYOND_M
    room = Room(np.vstack([position, line.between(0.0, line.length_m)]), reach_m, seen, surface)
    blocked = line.blocked(room, params.keep_m)
    if blocked is None:
        return NoWay(kind, f"The mission ahead keeps {params.keep_m:g} m from all that was seen.")
    here = np.vstack([position, position])
    here_m = min(room.seen_m(here), room.surface_m(here))
    if here_m < params.radius_m + params.least_beside_m:
        return NoWay(kind, f"The vehicle is only {here_m:.1f} m from what was seen.")
    find = way_over if kind == "over" else way_around
    return find(position, line, blocked, room, min(params.keep_m, here_m), params)
