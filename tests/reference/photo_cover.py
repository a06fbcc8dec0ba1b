"""How many photos see each cell, by looking through every photo at every cell."""

from __future__ import annotations

import math

import numpy as np


def photos_of_each_cell(
    top_m: np.ndarray,
    cell_m: float,
    photos: list[tuple[float, float, float, float]],
    *,
    half_across: float,
    half_along: float,
) -> np.ndarray:
    """(H, W) counts; the grid's north-west corner is (0, 0), photos are (east, north, height, heading in rad).

    A photo sees a cell's centre when it lies within the image and the straight ray from it to the camera runs
    above the cells under it, at evenly spaced points at most one cell apart.
    """
    height, width = top_m.shape
    counts = np.zeros((height, width), dtype=int)
    for row in range(height):
        for col in range(width):
            here = np.array([(col + 0.5) * cell_m, -(row + 0.5) * cell_m, float(top_m[row, col])])
            for east, north, up, heading in photos:
                camera = np.array([east, north, up])
                nose = np.array([math.sin(heading), math.cos(heading)])
                right = np.array([nose[1], -nose[0]])
                off, above = (here - camera)[:2], camera[2] - here[2]
                if not np.isfinite(above) or above <= 0:
                    continue
                if abs(off @ right) > above * half_across or abs(off @ nose) > above * half_along:
                    continue
                n = math.ceil(float(np.hypot(*off)) / cell_m)
                ray = [here + (camera - here) * k / n for k in range(1, n)]
                if all(_top_m(top_m, cell_m, p) <= p[2] for p in ray):
                    counts[row, col] += 1
    return counts


def _top_m(top_m: np.ndarray, cell_m: float, p: np.ndarray) -> float:
    row, col = math.floor(-p[1] / cell_m), math.floor(p[0] / cell_m)
    inside = 0 <= row < top_m.shape[0] and 0 <= col < top_m.shape[1]
    return float(top_m[row, col]) if inside else -math.inf
