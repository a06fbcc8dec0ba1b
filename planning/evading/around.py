"""Around: sideways, past it, and back onto the mission's line behind it, at one height (Miccinesi 2022, fig. 9)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import length_m
from planning.evading.keep_clear import Room
from planning.evading.line import LineAhead
from planning.evading.model import AvoidanceParams, Manoeuvre, NoWay

HIGHER_M = (0.0, 2.5, 5.0, 10.0)
"""Beside the line the ground may be higher than on it."""
BEHIND_M = (1.0, 4.0, 9.0, 16.0)
"""Behind the last place that is blocked, where the line is joined again."""
SIDEWAYS_STEPS = 4


def way_around(
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
