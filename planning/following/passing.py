"""Which places of a mission a flight has passed, those too that it passed higher while it avoided something.

A detour goes on above the mission: there a place counts within reach over ground, at its height or above it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from planning.following.reference import Reference

REACHED_M = 3.0
"""Without the vehicle's own word, a waypoint counts as reached within this distance of it."""
LOWER_M = 1.0
"""A vehicle that keeps the height of a place is measured this much below it at most."""


@dataclass(frozen=True, slots=True)
class Passing:
    """How one place was passed."""

    item: int
    """Index into ``Mission.items``."""
    t_s: float
    higher_m: float
    """Than planned; 0 where it was not passed on a detour."""


@dataclass(frozen=True, slots=True)
class Flown:
    """Positions of a flight: when and where, and in which of them the mission or a detour from it was flown."""

    t_s: F64
    xyz_m: F64
    on_mission: Bools
    on_detour: Bools


def passings(
    reference: Reference, flown: Flown, told: tuple[tuple[float, int], ...], *, from_s: float, from_line_s_m: float
) -> tuple[Passing, ...]:
    """The places from ``from_line_s_m`` along the line on, in its order, up to the first that was left out.

    ``told``: (time, item) as the vehicle reported them, from ``from_s`` on as the positions.
    """
    points = {int(item): k + 1 for k, item in enumerate(reference.leg_item)}
    found: list[Passing] = []
    t_s = from_s
    for item, point in points.items():
        if reference.s_m[point] < from_line_s_m - REACHED_M:
            continue
        passing = _passing(item, reference.points_m[point], flown, told, t_s)
        if passing is None:
            break
        found.append(passing)
        t_s = passing.t_s
    return tuple(found)


def _passing(
    item: int, place_m: F64, flown: Flown, told: tuple[tuple[float, int], ...], from_s: float
) -> Passing | None:
    """The first one since ``from_s``; the vehicle's own word goes before what can be measured."""
    said_s = [t for t, number in told if number == item and t >= from_s]
    if said_s:
        return Passing(item, said_s[0], 0.0)
    away_m, above_m = np.hypot(*(flown.xyz_m[:, :2] - place_m[:2]).T), flown.xyz_m[:, 2] - place_m[2]
    on_line = flown.on_mission & (np.abs(above_m) <= REACHED_M)
    higher = flown.on_detour & (above_m >= -LOWER_M)
    at = first_approach(away_m, (on_line | higher) & (flown.t_s >= from_s))
    if at is None:
        return None
    higher_m = float(above_m[at]) if flown.on_detour[at] else 0.0
    return Passing(item, float(flown.t_s[at]), max(0.0, higher_m))


def first_approach(away_m: F64, among: Bools) -> int | None:
    """Index of the nearest position during the first stay within ``REACHED_M`` of a place."""
    near = among & (away_m <= REACHED_M)
    if not near.any():
        return None
    begin = int(np.argmax(near))
    left = np.flatnonzero(~near[begin:])
    end = begin + int(left[0]) if len(left) else len(near)
    return begin + int(np.argmin(away_m[begin:end]))
