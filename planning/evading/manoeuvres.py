"""Ways up, over and around what was seen, with the clearance of each.

Both papers avoid upwards or sideways and never downwards (Miccinesi 2022, fig. 9; Bigazzi 2022, figs 9-10).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import length_m
from planning.evading.keep_clear import Room, Seen, Surface
from planning.evading.line_ahead import LineAhead
from planning.evading.way_past import AvoidanceParams, Manoeuvre, NoWay

BEYOND_M = 20.0
"""Distances are exact up to so much beyond what must be kept."""
HIGHER_M = (0.0, 2.5, 5.0, 10.0)
"""Beside the line the ground may be higher than on it."""
BEHIND_M = (1.0, 4.0, 9.0, 16.0)
"""Behind the last place that is blocked, where the line is joined again."""
SIDEWAYS_STEPS = 4


def way_past(
    kind: Literal["over", "around"],
    position_enu_m: ArrayLike,
    line_enu_m: ArrayLike,
    seen: Sequence[Seen],
    surface: Surface | None = None,
    params: AvoidanceParams | None = None,
) -> Manoeuvre | NoWay:
    """A way past everything, back to the mission or onto it, that keeps clear of all of it.

    ``position_enu_m`` (3,) the vehicle; ``line_enu_m`` (K, 3) the mission ahead from beside the vehicle on, K >= 2;
    ``seen`` the unexplained voxels of each map. Pure; a few milliseconds for ten thousand voxels near the line.
    """
    params = params or AvoidanceParams()
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
    find = _way_over if kind == "over" else _way_around
    return find(position, line, blocked, room, min(params.keep_m, here_m), params)


over = partial(way_past, "over")
"""Straight up, then along the line ahead at the smallest offset that keeps clear of everything."""
around = partial(way_past, "around")
"""Sideways past what was seen and back onto the line behind it."""


def _way_over(
    position: F64, line: LineAhead, blocked: tuple[float, float], room: Room, keep_m: float, params: AvoidanceParams
) -> Manoeuvre | NoWay:
    """``Manoeuvre`` or ``NoWay``. What was not seen above the highest voxel is not known to be free."""
    end_m = min(line.length_m, blocked[1] + params.keep_m + params.step_m)
    least_m = max(0.0, float(position[2] - line.at(0.0)[2]))
    for offset_m in np.arange(least_m, params.ceiling_m + 1e-9, params.step_m):
        if room.is_clear(_raised(position, line, line.length_m, offset_m), keep_m):
            points = _raised(position, line, end_m, offset_m)
            return Manoeuvre(
                kind="over",
                points_enu_m=points,
                leg=line.leg_at(end_m),
                height_offset_m=float(offset_m),
                seen_m=room.seen_m(points),
                surface_m=room.surface_m(points),
                length_m=length_m(points),
                top_unseen=not room.with_open_tops().is_clear_of_seen(points, keep_m),
            )
    return NoWay("over", f"It is not clear up to {params.ceiling_m:g} m above the plan.")


def _raised(position: F64, line: LineAhead, to_m: float, offset_m: float) -> F64:
    above = line.between(0.0, to_m) + np.array([0.0, 0.0, offset_m])
    top = np.array([position[0], position[1], max(position[2], above[0, 2])])
    return np.vstack([position, top, above[1:]])  # Miccinesi 2022, fig. 9


def _way_around(
    position: F64, line: LineAhead, blocked: tuple[float, float], room: Room, keep_m: float, params: AvoidanceParams
) -> Manoeuvre | NoWay:
    """``Manoeuvre`` or ``NoWay``: the shortest of those that leave the line least.

    What nobody has seen behind the obstacle is not flown into: the way goes on beside it first.
    """
    seen, room = room, room.with_open_tops().with_unseen(position, params.unseen_m)
    blocked = line.blocked(room, keep_m) or blocked
    joins = _joins(line, blocked[1] + params.keep_m)
    if not joins:
        return NoWay("around", "The mission ahead ends at what was seen: there is no way back onto it.")
    for higher_m in HIGHER_M:
        for aside_m in np.arange(params.keep_m, params.sideways_m + 1e-9, SIDEWAYS_STEPS * params.step_m):
            ways = [
                (points, along_m)
                for points, along_m in _ways(position, line, joins, aside_m, higher_m)
                if room.is_clear(_with_tail(points, line, along_m), keep_m)
            ]
            if ways:
                points, along_m = min(ways, key=lambda way: length_m(way[0]))
                return Manoeuvre(
                    kind="around",
                    points_enu_m=points,
                    leg=line.leg_at(along_m),
                    height_offset_m=0.0,
                    seen_m=seen.seen_m(points),
                    surface_m=seen.surface_m(points),
                    length_m=length_m(points),
                )
    return NoWay(
        "around",
        f"Nothing is clear within {params.sideways_m:g} m to either side; {params.unseen_m:g} m behind what was seen "
        "count as filled.",
    )


def _joins(line: LineAhead, from_m: float) -> list[float]:
    places = [from_m + behind_m for behind_m in BEHIND_M if from_m + behind_m < line.length_m]
    return places or ([line.length_m] if from_m <= line.length_m else [])


def _ways(
    position: F64, line: LineAhead, joins: list[float], aside_m: float, higher_m: float
) -> Iterator[tuple[F64, float]]:
    """At the height of the vehicle or of the highest place of the line that is left out, whichever is higher."""
    ahead = line.direction(0.0)
    for along_m in joins:
        up_m = max(float(position[2]), float(line.between(0.0, along_m)[:, 2].max())) + higher_m
        back, there = line.direction(along_m), line.at(along_m)
        for side in (1.0, -1.0):
            out = position[:2] + side * aside_m * _right(ahead)
            beside = there[:2] + side * aside_m * _right(back)
            flat = np.vstack([position[:2], out, beside, there[:2]])  # Miccinesi 2022, fig. 9
            points = np.column_stack([flat, np.full(4, up_m)])
            yield (np.vstack([position, points]) if up_m > position[2] else points), along_m


def _with_tail(points: F64, line: LineAhead, along_m: float) -> F64:
    """With the way from the last point to the waypoint that is flown to next."""
    return np.vstack([points, line.after(along_m)])


def _right(direction: F64) -> F64:
    return np.array([direction[1], -direction[0]])
