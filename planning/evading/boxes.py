"""Exact distance in space between straight lines and voxels, which are closed cubes or columns.

The squared distance of the moving point a + t d to a box is convex in t and quadratic between the values of t where
a coordinate passes a face, so its minimum over a segment has a closed form.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64
from planning.certificate.quads import zero_between


def nearest_box(
    points_m: F64, centres_m: F64, half_m: float, *, half_up_m: F64 | None = None, at_most_m: float = np.inf
) -> tuple[float, int]:
    """Smallest distance of a polyline (K, 3) to boxes with centres (N, 3), and which box that is.

    ``half_up_m`` (N,): half the height of each; None: they are cubes. Boxes farther than ``at_most_m`` are passed over:
    (inf, -1) when there is none nearer. 0 inside a box.
    """
    points = np.ascontiguousarray(points_m, np.float64)
    centres = np.ascontiguousarray(centres_m, np.float64)
    return _nearest_box(points, centres, half_m, half_heights(half_up_m, half_m, len(centres)), at_most_m)


def half_heights(half_up_m: F64 | None, half_m: float, count: int) -> F64:
    """(N,) Of boxes; those of cubes where nothing else is said."""
    return np.full(count, half_m) if half_up_m is None else np.ascontiguousarray(half_up_m, np.float64)


@njit(cache=True, nogil=True)
def _half_slope(t, a, d, low, high):
    """Half the derivative of the squared distance by t."""
    slope = 0.0
    for k in range(3):
        p = a[k] + t * d[k]
        if p < low[k]:
            slope += d[k] * (p - low[k])
        elif p > high[k]:
            slope += d[k] * (p - high[k])
    return slope


@njit(cache=True, nogil=True)
def segment_box_sq(a, d, low, high):
    """(smallest squared distance, t) of a + t d, t in [0, 1], to the box between corners ``low`` and ``high``."""
    left, right = 0.0, 1.0
    for k in range(3):
        if d[k] == 0.0:
            continue
        for face in (low[k], high[k]):
            t = (face - a[k]) / d[k]
            if left < t < right:
                if _half_slope(t, a, d, low, high) > 0.0:
                    right = t
                else:
                    left = t
    t = zero_between(left, right, _half_slope(left, a, d, low, high), _half_slope(right, a, d, low, high))
    sq = 0.0
    for k in range(3):
        p = a[k] + t * d[k]
        out = max(low[k] - p, p - high[k], 0.0)
        sq += out * out
    return sq, t


@njit(cache=True, nogil=True)
def _nearest_box(points, centres, half_m, half_up_m, at_most_m):
    best, which = at_most_m * at_most_m, -1
    low, high, half = np.empty(3), np.empty(3), np.full(3, half_m)
    for i in range(points.shape[0] - 1):
        a, d = points[i], points[i + 1] - points[i]
        for j in range(centres.shape[0]):
            apart, half[2] = 0.0, half_up_m[j]
            for k in range(3):
                low[k], high[k] = centres[j, k] - half[k], centres[j, k] + half[k]
                out = max(low[k] - max(a[k], a[k] + d[k]), min(a[k], a[k] + d[k]) - high[k], 0.0)
                apart += out * out
            if apart > best or (which >= 0 and apart == best):
                continue
            sq, _ = segment_box_sq(a, d, low, high)
            if sq < best or (which < 0 and sq == best):
                best, which = sq, j
    return (np.sqrt(best) if which >= 0 else np.inf), which
