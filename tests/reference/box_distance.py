"""Distance between a polyline and cubes, slowly: every cube against many places of every segment."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mapping.geometry.arrays import F64

STEP_M = 0.1


def polyline_boxes_m(points_m: F64, centres_m: F64, half_m: float) -> float:
    """Smallest distance of the polyline (K, 3) to any cube (N, 3); true to within half a step."""
    places = np.vstack([_places(a, b) for a, b in pairwise(points_m)])
    best_sq = np.inf
    for centre in centres_m:
        out = np.maximum(np.abs(places - centre) - half_m, 0.0)
        best_sq = min(best_sq, float((out * out).sum(axis=1).min()))
    return float(np.sqrt(best_sq))


def _places(a: F64, b: F64) -> F64:
    count = max(2, int(np.linalg.norm(b - a) / STEP_M) + 2)
    return a + np.linspace(0, 1, count)[:, None] * (b - a)
