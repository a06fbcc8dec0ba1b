"""Simple polygons in the plane: whether they are, and how far they reach in strips."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mapping.geometry.arrays import F64

TOUCHING_M = 1e-6
"""Intervals closer than this are one."""


def area_m2(corners_m: F64) -> float:
    """Area of a simple polygon, corners (N, 2) in either order (shoelace formula)."""
    x, y = (corners_m - corners_m[0]).T
    return abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))) / 2


def crossing_edges(corners_m: F64) -> tuple[int, int] | None:
    """The first two edges (by index of their first corner) that touch without being neighbours; None: simple."""
    a, b = corners_m, np.roll(corners_m, -1, axis=0)
    count = len(a)
    for i in range(count):
        last = count if i else count - 1
        j = np.arange(i + 2, last)
        hit = j[_touch(a[i], b[i], a[j], b[j])]
        if hit.size:
            return i, int(hit[0])
    return None


def _touch(p: F64, q: F64, a: F64, b: F64) -> np.ndarray:
    """Whether segment p-q shares a point with each of the segments a-b, touching included."""

    def side(o: F64, d: F64, r: F64) -> F64:
        e, f = d - o, r - o
        return np.sign(e[..., 0] * f[..., 1] - e[..., 1] * f[..., 0])

    across = (side(p, q, a) * side(p, q, b) <= 0) & (side(a, b, p) * side(a, b, q) <= 0)
    boxes = (np.minimum(a, b) <= np.maximum(p, q)) & (np.maximum(a, b) >= np.minimum(p, q))
    return across & boxes.all(axis=-1)


def extents(corners_m: F64, low_m: float, high_m: float) -> list[tuple[float, float]]:
    """Intervals of x that the polygon covers somewhere in the strip ``low_m <= y <= high_m``, from left to right.

    Between two neighbouring corners' heights the polygon falls into trapezoids; each covers the interval from
    its leftmost to its rightmost corner, and intervals that meet are joined.
    """
    ys = corners_m[:, 1]
    levels = np.unique(np.concatenate([[low_m, high_m], ys[(ys > low_m) & (ys < high_m)]]))
    covered = [part for a, b in pairwise(levels.tolist()) for part in _trapezoids(corners_m, a, b)]
    joined: list[tuple[float, float]] = []
    for left, right in sorted(covered):
        if joined and left <= joined[-1][1] + TOUCHING_M:
            joined[-1] = (joined[-1][0], max(joined[-1][1], right))
        else:
            joined.append((left, right))
    return joined


def _trapezoids(corners_m: F64, low_m: float, high_m: float) -> list[tuple[float, float]]:
    """Extents in x of the polygon's parts in a strip without a corner inside."""
    (x0, y0), (x1, y1) = corners_m.T, np.roll(corners_m, -1, axis=0).T
    middle_m = (low_m + high_m) / 2
    crosses = (y0 <= middle_m) != (y1 <= middle_m)
    x0, y0, x1, y1 = x0[crosses], y0[crosses], x1[crosses], y1[crosses]
    low, middle, high = (x0 + (y - y0) * (x1 - x0) / (y1 - y0) for y in (low_m, middle_m, high_m))
    order = np.argsort(middle)
    least, most = np.minimum(low, high)[order], np.maximum(low, high)[order]
    return list(zip(least[::2].tolist(), most[1::2].tolist(), strict=True))
