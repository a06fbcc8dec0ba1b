"""Slope and roughness of one patch by a general least-squares solver."""

from __future__ import annotations

import math

import numpy as np


def patch_plane(elevation_m: np.ndarray, row: int, col: int, half: int, resolution_m: float) -> tuple[float, float]:
    """(slope in rad, root of the mean squared distance from the plane) of the known cells around one cell."""
    points = [
        (j * resolution_m, i * resolution_m, float(elevation_m[i, j]))
        for i in range(row - half, row + half + 1)
        for j in range(col - half, col + half + 1)
        if 0 <= i < elevation_m.shape[0] and 0 <= j < elevation_m.shape[1] and np.isfinite(elevation_m[i, j])
    ]
    x, y, z = np.array(points).T
    design = np.column_stack([x - x.mean(), y - y.mean(), np.ones(len(x))])
    (a, b, c), *_ = np.linalg.lstsq(design, z, rcond=None)
    rest = z - design @ np.array([a, b, c])
    return math.atan(math.hypot(a, b)), math.sqrt(float((rest**2).mean()))
