"""The shortest way around a fence, slowly: every place where a way may turn, every pair of them, Dijkstra by hand.

Here shapes are flat already: (N, 2) corners with a radius to keep from each, a circle being one corner. A pair sees
each other where the triangle with each place that has to be seen keeps its distance from all shapes.
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from planning.fence.distance import to_circle, to_polygon

Places = np.ndarray
Shape = tuple[Places, float]
"""Corners, and what is kept from them."""


def turning_places(shapes: list[Shape], step_deg: float = 10.0) -> Places:
    """On a circumscribed polygon around each corner."""
    angle = np.radians(np.arange(0.0, 360.0, step_deg))
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) / math.cos(math.radians(step_deg / 2))
    return np.vstack([corner + kept_m * ring for corners_m, kept_m in shapes for corner in corners_m])


def kept(a: Places, b: Places, seen_from_m: Places, shapes: list[Shape], spare_m: float = 0.0) -> np.ndarray:
    """(K,) whether all that lies between a, b and each place ``seen_from_m`` keeps its distance."""
    fine = np.ones(len(a), dtype=bool)
    for target_m in seen_from_m:
        triangles = np.stack([a, b, np.broadcast_to(target_m, a.shape)], axis=1)
        for corners_m, kept_m in shapes:
            if len(corners_m) == 1:
                away_m = to_circle(triangles, corners_m[0], 0.0, inclusion=False).distance_m
            else:
                away_m = to_polygon(triangles, corners_m, inclusion=False).distance_m
            fine &= away_m >= kept_m + spare_m - 1e-9
    return fine


def shortest_m(from_m: Places, to_m: Places, seen_from_m: Places, shapes: list[Shape]) -> float:
    """inf: there is no way."""
    places = np.vstack([from_m, to_m, turning_places(shapes)])
    places = places[kept(places, places, seen_from_m, shapes)]
    assert np.array_equal(places[:2], [from_m, to_m])
    i, j = np.triu_indices(len(places), k=1)
    sees = np.zeros((len(places), len(places)), dtype=bool)
    sees[i, j] = sees[j, i] = kept(places[i], places[j], seen_from_m, shapes)
    best, queue = {0: 0.0}, [(0.0, 0)]
    while queue:
        so_far_m, at = heapq.heappop(queue)
        if at == 1:
            return so_far_m
        for other in np.flatnonzero(sees[at]):
            total_m = so_far_m + float(np.linalg.norm(places[at] - places[other]))
            if total_m < best.get(int(other), math.inf):
                best[int(other)] = total_m
                heapq.heappush(queue, (total_m, int(other)))
    return math.inf
