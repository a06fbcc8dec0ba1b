"""The place of a planned line that belongs to a position, and how far beside and above it the position is.

The place on each leg is the horizontally nearest one, on an upright leg the one at the position's height.
Between legs the nearest counts, heights weighing a little so that a climb on the spot is told from the
legs it joins. A route may cross itself or come back the way it went: what lies near the place before is
preferred, and going on is preferred to going back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, I64
from planning.following.reference import Reference

AHEAD_M, BEHIND_M = 30.0, 10.0
"""How far along the line from the last place the next one is looked for first."""
LOST_M = 3.0
"""A place elsewhere on the line is taken once it is this much nearer than the best near the last place."""
HEIGHT_WEIGHT = 0.2
"""Share of the height error in the choice between legs."""
BACK_WEIGHT, AHEAD_WEIGHT, MOVE_LIMIT_M = 0.02, 0.005, 0.1
"""What moving along the line costs in the choice, per metre and at most: it decides between equals only."""
UPRIGHT_M = 1e-6


@dataclass(frozen=True, slots=True)
class Deviation:
    """Where one position is against the line."""

    s_m: float
    """Distance along the line of the place that belongs to the position."""
    cross_track_m: float
    """Horizontal distance to it, positive to the right of the line."""
    height_error_m: float
    """Height above it."""
    leg: int
    share: float
    """Of the leg's length that lies before the place."""


@dataclass(frozen=True, slots=True)
class Deviations:
    """The same of a whole track, one entry per position."""

    s_m: F64
    cross_track_m: F64
    height_error_m: F64
    leg: I64
    share: F64


def follow(reference: Reference, xyz_m: tuple[float, float, float], *, near_s_m: float | None = None) -> Deviation:
    """Where one position (x, y, alt_dsm in the model's CRS) is; ``near_s_m`` is ``s_m`` of the position before it."""
    x, y, z = xyz_m
    near = math.nan if near_s_m is None else near_s_m
    leg, share, s_m, cross_m, above_m = _place(reference.points_m, reference.s_m, x, y, z, near)
    return Deviation(s_m, cross_m, above_m, int(leg), share)


def follow_track(reference: Reference, xyz_m: F64, *, near_s_m: float | None = None) -> Deviations:
    """Where each of (N, 3) positions is that were flown one after the other."""
    xyz = np.ascontiguousarray(xyz_m, dtype=np.float64).reshape(-1, 3)
    near = math.nan if near_s_m is None else near_s_m
    s_m, cross_m, above_m, leg, share = _places(reference.points_m, reference.s_m, xyz, near)
    return Deviations(s_m, cross_m, above_m, leg, share)


@njit(cache=True, nogil=True)
def _on_leg(points, k, x, y, z):
    """(share, distance, signed distance, height above) of the leg's place that belongs to the position."""
    ax, ay, az = points[k, 0], points[k, 1], points[k, 2]
    dx, dy, dz = points[k + 1, 0] - ax, points[k + 1, 1] - ay, points[k + 1, 2] - az
    length_sq = dx * dx + dy * dy
    if length_sq > UPRIGHT_M * UPRIGHT_M:
        share = ((x - ax) * dx + (y - ay) * dy) / length_sq
    elif dz != 0.0:
        share = (z - az) / dz
    else:
        share = 0.0
    share = min(1.0, max(0.0, share))
    distance = np.hypot(x - ax - share * dx, y - ay - share * dy)  # Melita 2020, fig. 22
    left = dx * (y - ay) - dy * (x - ax) > 0.0
    return share, distance, -distance if left else distance, z - az - share * dz


@njit(cache=True, nogil=True)
def _place(points, s_m, x, y, z, near):
    """(leg, share, s, signed distance, height above) of the place that belongs to the position."""
    best, best_leg, local, local_leg = np.inf, 0, np.inf, -1
    for k in range(points.shape[0] - 1):
        share, distance, _, above = _on_leg(points, k, x, y, z)
        cost = np.hypot(distance, HEIGHT_WEIGHT * above)
        s = s_m[k] + share * (s_m[k + 1] - s_m[k])
        if s < near:
            cost += min(MOVE_LIMIT_M, BACK_WEIGHT * (near - s))
        elif s > near:
            cost += min(MOVE_LIMIT_M, AHEAD_WEIGHT * (s - near))
        if cost < best:
            best, best_leg = cost, k
        if near - BEHIND_M <= s <= near + AHEAD_M and cost < local:
            local, local_leg = cost, k
    leg = local_leg if local_leg >= 0 and local <= best + LOST_M else best_leg
    share, _, signed, above = _on_leg(points, leg, x, y, z)
    return leg, share, s_m[leg] + share * (s_m[leg + 1] - s_m[leg]), signed, above


@njit(cache=True, nogil=True)
def _places(points, s_m, xyz, near):
    n = xyz.shape[0]
    s, cross, above, share = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    leg = np.empty(n, np.int64)
    for i in range(n):
        leg[i], share[i], s[i], cross[i], above[i] = _place(points, s_m, xyz[i, 0], xyz[i, 1], xyz[i, 2], near)
        near = s[i]
    return s, cross, above, leg, share
