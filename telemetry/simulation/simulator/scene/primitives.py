"""Boxes, cylinders and ellipsoids as rows of numbers, and where rays meet them.

A row: kind, east, north, low, high, half width, half depth, cosine and sine of the heading, leaf path.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64

BOX, CYLINDER, ELLIPSOID = 0.0, 1.0, 2.0
COLUMNS = 10
_NEVER = math.inf


def box_row(
    place: tuple[float, float], low_m: float, high_m: float, width_m: float, depth_m: float, heading_rad: float
) -> list[float]:
    turn = (math.cos(heading_rad), math.sin(heading_rad))
    return [BOX, *place, low_m, high_m, width_m / 2, depth_m / 2, *turn, 0.0]


def cylinder_row(place: tuple[float, float], low_m: float, high_m: float, radius_m: float) -> list[float]:
    return [CYLINDER, *place, low_m, high_m, radius_m, radius_m, 1.0, 0.0, 0.0]


def ellipsoid_row(
    place: tuple[float, float], low_m: float, high_m: float, radius_m: float, leaf_path_m: float = 0.0
) -> list[float]:
    """Upright; ``leaf_path_m`` is how far a ray gets into it on average."""
    return [ELLIPSOID, *place, low_m, high_m, radius_m, radius_m, 1.0, 0.0, leaf_path_m]


@njit(cache=True, nogil=True)
def _slab(start, step, low, high, t0, t1):
    """The part of [t0, t1] on which ``start + t * step`` lies in [low, high]; empty where t0 > t1."""
    if step == 0.0:
        return (t0, t1) if low <= start <= high else (_NEVER, -_NEVER)
    a, b = (low - start) / step, (high - start) / step
    return max(t0, min(a, b)), min(t1, max(a, b))


@njit(cache=True, nogil=True)
def _round(a, b, c, t0, t1):
    """The part of [t0, t1] on which a t^2 + 2 b t + c <= 0, a >= 0."""
    if a == 0.0:
        return (t0, t1) if c <= 0.0 else (_NEVER, -_NEVER)
    inside = b * b - a * c
    if inside < 0.0:
        return _NEVER, -_NEVER
    root = math.sqrt(inside)
    return max(t0, (-b - root) / a), min(t1, (-b + root) / a)


@njit(cache=True, nogil=True)
def span(row, ox, oy, oz, dx, dy, dz):
    """The stretch of the ray o + t d, t >= 0, inside a primitive; empty where its start is beyond its end."""
    x, y = ox - row[1], oy - row[2]
    if row[0] == ELLIPSOID:
        a, c = row[5], (row[4] - row[3]) / 2
        x, y, z = x / a, y / a, (oz - (row[3] + row[4]) / 2) / c
        dx, dy, dz = dx / a, dy / a, dz / c
        return _round(dx * dx + dy * dy + dz * dz, x * dx + y * dy + z * dz, x * x + y * y + z * z - 1.0, 0.0, _NEVER)
    t0, t1 = _slab(oz, dz, row[3], row[4], 0.0, _NEVER)
    if t0 > t1:
        return t0, t1
    if row[0] == CYLINDER:
        return _round(dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - row[5] * row[5], t0, t1)
    cos, sin = row[7], row[8]
    t0, t1 = _slab(x * cos - y * sin, dx * cos - dy * sin, -row[5], row[5], t0, t1)
    return _slab(x * sin + y * cos, dx * sin + dy * cos, -row[6], row[6], t0, t1)


@njit(cache=True, nogil=True)
def distance(row, px, py, pz):
    """Signed distance of a point to a primitive's surface, negative inside; ellipsoids to first order."""
    x, y = px - row[1], py - row[2]
    if row[0] == ELLIPSOID:
        a, c = row[5], (row[4] - row[3]) / 2
        z = pz - (row[3] + row[4]) / 2
        near = math.sqrt((x * x + y * y) / (a * a) + z * z / (c * c))
        slope = math.sqrt((x * x + y * y) / a**4 + z * z / c**4)
        return near * (near - 1.0) / slope if slope > 0.0 else -min(a, c)
    up = max(row[3] - pz, pz - row[4])
    if row[0] == CYLINDER:
        out, beside = math.hypot(x, y) - row[5], -_NEVER
    else:
        cos, sin = row[7], row[8]
        out, beside = abs(x * cos - y * sin) - row[5], abs(x * sin + y * cos) - row[6]
    outside = math.sqrt(max(0.0, up) ** 2 + max(0.0, out) ** 2 + max(0.0, beside) ** 2)
    return outside if outside > 0.0 else max(up, out, beside)


@njit(cache=True, nogil=True)
def distances(rows, points, nearest, index):
    """Signed distance of each point to the nearest primitive, and which that is; inf and -1 where there is none."""
    for i in range(points.shape[0]):
        nearest[i], index[i] = _NEVER, -1
        for k in range(rows.shape[0]):
            found = distance(rows[k], points[i, 0], points[i, 1], points[i, 2])
            if found < nearest[i]:
                nearest[i], index[i] = found, k


@njit(cache=True, nogil=True)
def top_under(rows, px, py, pz):
    """Height of the highest solid primitive under (or at) a point; -inf where there is none."""
    best = -_NEVER
    for k in range(rows.shape[0]):
        row = rows[k]
        if row[0] == ELLIPSOID or row[4] > pz or row[4] <= best:
            continue
        if distance(row, px, py, row[4]) <= 0.0:
            best = row[4]
    return best


def bounding_spheres(rows: F64) -> F64:
    """(K, 4) centre and radius."""
    half = (rows[:, 4] - rows[:, 3]) / 2
    flat = np.where(rows[:, 0] == BOX, np.hypot(rows[:, 5], rows[:, 6]), rows[:, 5])
    radius = np.where(rows[:, 0] == ELLIPSOID, np.maximum(flat, half), np.hypot(flat, half))
    return np.column_stack([rows[:, 1], rows[:, 2], rows[:, 3] + half, radius])
