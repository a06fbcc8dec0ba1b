"""How near flights come to what a fence forbids, as seen from above.

A flight is given as triangles: a leg and the ways home from everywhere on it sweep one, a leg alone is one of no width.
What is forbidden is the inside of an exclusion or the outside of an inclusion; the distance to it is exact in the
plane, and 0 within it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64


@dataclass(frozen=True, slots=True)
class NearestOfTriangles:
    """Of one triangle after the other."""

    distance_m: F64
    """(K,)"""
    place_m: F64
    """(K, 2) where on the triangle it comes so near."""

    def worst(self) -> tuple[int, float]:
        k = int(np.argmin(self.distance_m))
        return k, float(self.distance_m[k])


def to_polygon(triangles_m: F64, corners_m: F64, *, inclusion: bool) -> NearestOfTriangles:
    """From (K, 3, 2) triangles to what a simple polygon with (N, 2) corners forbids."""
    count = len(triangles_m)
    best_m, place_m = np.full(count, np.inf), triangles_m[:, 0].copy()
    for side in range(3):
        a, b = triangles_m[:, side], triangles_m[:, (side + 1) % 3]
        for p, q in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
            distance_m, at_m = _between(a, b, p, q)
            nearer = distance_m < best_m
            best_m[nearer], place_m[nearer] = distance_m[nearer], at_m[nearer]
    for corner in corners_m:  # a whole shape, or a notch of one, may lie within a triangle
        within = _holds(triangles_m, corner)
        best_m[within], place_m[within] = 0.0, corner
    for vertex in range(3):
        places = triangles_m[:, vertex]
        forbidden = inside_polygon(places, corners_m) != inclusion
        best_m[forbidden], place_m[forbidden] = 0.0, places[forbidden]
    return NearestOfTriangles(best_m, place_m)


def to_circle(triangles_m: F64, centre_m: F64, radius_m: float, *, inclusion: bool) -> NearestOfTriangles:
    """As `to_polygon`, of a circle."""
    rows = np.arange(len(triangles_m))
    if inclusion:
        away_m = np.linalg.norm(triangles_m - centre_m, axis=2)
        farthest = np.argmax(away_m, axis=1)
        return NearestOfTriangles(np.maximum(0.0, radius_m - away_m[rows, farthest]), triangles_m[rows, farthest])
    nearest = [foot(triangles_m[:, k], triangles_m[:, (k + 1) % 3], centre_m) for k in range(3)]
    away_m = np.stack([np.linalg.norm(place - centre_m, axis=1) for place in nearest])
    side = np.argmin(away_m, axis=0)
    place_m, within = np.stack(nearest)[side, rows], _holds(triangles_m, centre_m)
    place_m[within] = centre_m
    return NearestOfTriangles(np.where(within, 0.0, np.maximum(0.0, away_m[side, rows] - radius_m)), place_m)


def one_to_polygon(triangle_m: F64, corners_m: F64, *, inclusion: bool) -> float:
    """As `to_polygon` of one (3, 2) triangle, over all edges at once: for who asks many times a second."""
    ends_m = np.roll(corners_m, -1, axis=0)
    if (_is_inside(triangle_m[0], corners_m, ends_m) != inclusion) or _holds(triangle_m[None], corners_m).any():
        return 0.0
    sides = zip(triangle_m, np.roll(triangle_m, -1, axis=0), strict=True)
    return min(float(_between(corners_m, ends_m, p, q)[0].min()) for p, q in sides)


def inside_polygon(places_m: F64, corners_m: F64) -> np.ndarray:
    """(K,) whether each of (K, 2) places lies inside, by counting the edges to its east."""
    x, y = places_m.T
    (ax, ay), (bx, by) = corners_m.T, np.roll(corners_m, -1, axis=0).T
    inside = np.zeros(len(places_m), dtype=bool)
    for k in range(len(corners_m)):
        if ay[k] == by[k]:
            continue
        straddles = (ay[k] <= y) != (by[k] <= y)
        crossing_x = ax[k] + (y - ay[k]) * (bx[k] - ax[k]) / (by[k] - ay[k])
        inside ^= straddles & (x < crossing_x)
    return inside


def _is_inside(place_m: F64, corners_m: F64, ends_m: F64) -> bool:
    x, y = place_m
    straddles = (corners_m[:, 1] <= y) != (ends_m[:, 1] <= y)
    a, b = corners_m[straddles], ends_m[straddles]
    crossing_x = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    return bool(np.count_nonzero(x < crossing_x) % 2)


def _between(a: F64, b: F64, p: F64, q: F64) -> tuple[F64, F64]:
    """(K,) distances of the segments a-b to the segment p-q, and (K, 2) where on a-b."""
    candidates = [foot(a, b, p), foot(a, b, q), a, b]
    reach = np.stack(
        [
            np.linalg.norm(candidates[0] - p, axis=1),
            np.linalg.norm(candidates[1] - q, axis=1),
            np.linalg.norm(foot(p, q, a) - a, axis=1),
            np.linalg.norm(foot(p, q, b) - b, axis=1),
        ]
    )
    which, rows = np.argmin(reach, axis=0), np.arange(len(a))
    distance_m, place_m = reach[which, rows], np.stack(candidates)[which, rows]
    share = _crossing(a, b, p, q)
    crosses = ~np.isnan(share)
    distance_m[crosses] = 0.0
    place_m[crosses] = (a + share[:, None] * (b - a))[crosses]
    return distance_m, place_m


def _crossing(a: F64, b: F64, p: F64, q: F64) -> F64:
    """(K,) share of a-b at which it crosses p-q, NaN where it does not; touching ends are the feet's business."""
    along, edge = b - a, q - p
    cross = along[:, 0] * edge[1] - along[:, 1] * edge[0]
    to = p - a
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (to[:, 0] * edge[1] - to[:, 1] * edge[0]) / cross
        on_edge = (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / cross
        crosses = (share >= 0.0) & (share <= 1.0) & (on_edge >= 0.0) & (on_edge <= 1.0)
    return np.where(crosses, share, np.nan)


def foot(a: F64, b: F64, p: F64) -> F64:
    """The point of each segment a-b nearest to p; a and b, or p, may be one point or one for each."""
    along = b - a
    square = np.sum(along * along, axis=-1)
    share = np.sum((p - a) * along, axis=-1) / np.where(square > 0.0, square, 1.0)
    return a + np.clip(share, 0.0, 1.0)[..., None] * along


def _holds(triangles_m: F64, place_m: F64) -> np.ndarray:
    """(K,) whether the place lies strictly inside each triangle; one without width holds nothing."""
    sides = []
    for k in range(3):
        a, b = triangles_m[:, k], triangles_m[:, (k + 1) % 3]
        e, f = b - a, place_m - a
        sides.append(e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0])
    turned = np.stack(sides)
    return np.all(turned > 0.0, axis=0) | np.all(turned < 0.0, axis=0)
