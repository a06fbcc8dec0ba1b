"""Exact smallest and largest height of straight lines above the cells below them.

The cells that a line passes are walked row by row; over one cell the line's height is linear, so its
extremes lie at the ends of the interval. Cells are closed: a line that runs along a border, or touches
a corner, is judged against every cell it touches, which can only lower the smallest height.

Coordinates: metres from the model's north-west corner, x to the east, y to the SOUTH (rows), z up.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


def height_range(elevation_m: F32, resolution_m: float, start_m: F64, end_m: F64) -> tuple[F64, F64]:
    """Smallest and largest height above the cells below each segment, (N,) each.

    ``start_m`` and ``end_m`` are (N, 3). The smallest is -inf where the segment passes an unknown cell
    or leaves the model; the largest regards known cells only (-inf where there is none).
    """
    lowest_m, highest_m = np.empty(len(start_m)), np.empty(len(start_m))
    _ranges(
        elevation_m,
        resolution_m,
        np.ascontiguousarray(start_m, dtype=np.float64),
        np.ascontiguousarray(end_m, dtype=np.float64),
        lowest_m,
        highest_m,
    )
    return lowest_m, highest_m


@njit(cache=True, nogil=True)
def _inside(a, d, low, high, t0, t1):
    """The part of [t0, t1] in which a + t d lies in [low, high]; empty when the first exceeds the second."""
    if d == 0.0:
        return (t0, t1) if low <= a <= high else (1.0, 0.0)
    enter, leave = (low - a) / d, (high - a) / d
    if enter > leave:
        enter, leave = leave, enter
    return max(t0, enter), min(t1, leave)


@njit(cache=True, nogil=True)
def _touched(low_m, high_m, res):
    """First and last index of the cells whose closed interval meets [low_m, high_m]."""
    return int(np.ceil(low_m / res)) - 1, int(np.floor(high_m / res))


@njit(cache=True, nogil=True)
def _range_in_row(elevation_m, res, row, ax, az, dx, dz, t0, t1, lowest, highest):
    xa, xb = ax + t0 * dx, ax + t1 * dx
    first, last = _touched(min(xa, xb), max(xa, xb), res)
    for col in range(first, last + 1):
        u0, u1 = _inside(ax, dx, col * res, (col + 1) * res, t0, t1)
        if u0 > u1:
            continue
        if not (0 <= row < elevation_m.shape[0] and 0 <= col < elevation_m.shape[1]):
            return -np.inf, highest
        ground = np.float64(elevation_m[row, col])
        if not np.isfinite(ground):
            lowest = -np.inf
            continue
        z0, z1 = az + u0 * dz, az + u1 * dz
        lowest = min(lowest, min(z0, z1) - ground)
        highest = max(highest, max(z0, z1) - ground)
    return lowest, highest


@njit(cache=True, nogil=True)
def _ranges(elevation_m, res, start_m, end_m, lowest_m, highest_m):
    for k in range(start_m.shape[0]):
        ax, ay, az = start_m[k, 0], start_m[k, 1], start_m[k, 2]
        dx, dy, dz = end_m[k, 0] - ax, end_m[k, 1] - ay, end_m[k, 2] - az
        first, last = _touched(min(ay, ay + dy), max(ay, ay + dy), res)
        outside = first < 0 or last >= elevation_m.shape[0]
        lowest, highest = (-np.inf if outside else np.inf), -np.inf
        for row in range(max(first, 0), min(last, elevation_m.shape[0] - 1) + 1):
            t0, t1 = _inside(ay, dy, row * res, (row + 1) * res, 0.0, 1.0)
            if t0 <= t1:
                lowest, highest = _range_in_row(elevation_m, res, row, ax, az, dx, dz, t0, t1, lowest, highest)
        lowest_m[k] = lowest
        highest_m[k] = highest
