"""Simple polygons in the plane: whether they are, and where lines cross them."""

from __future__ import annotations

import numpy as np

from planning.model import F64


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


def chords(corners_m: F64, y_m: float) -> list[tuple[float, float]]:
    """Intervals of x inside the polygon along the horizontal line at ``y_m``, from left to right."""
    (x0, y0), (x1, y1) = corners_m.T, np.roll(corners_m, -1, axis=0).T
    # Half-open edges: a corner on the line belongs to one of its two edges.
    crosses = (y0 <= y_m) != (y1 <= y_m)
    at = np.sort(x0[crosses] + (y_m - y0[crosses]) * (x1 - x0)[crosses] / (y1 - y0)[crosses])
    return [(float(left), float(right)) for left, right in zip(at[::2], at[1::2], strict=True)]
