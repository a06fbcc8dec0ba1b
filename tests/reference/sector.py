"""The region of interest written slowly: Bigazzi 2022, eq. A1, point by point."""

from __future__ import annotations

import math


def sector(depth_m: float, fov_rad: float, height_m: float, resolution_m: float) -> list[tuple[float, float, float]]:
    """The points of eq. A1 in any order, with the one ring more that gives the counts of Table 1."""
    points: list[tuple[float, float, float]] = []
    layers = math.floor(height_m / (2 * resolution_m))
    for n_i in range(1, math.ceil(depth_m / resolution_m) + 2):
        arc = math.ceil(n_i * fov_rad / 2)
        for n_j in range(-arc, arc + 1):
            for n_k in range(-layers, layers + 1):
                x = n_i * resolution_m * math.sin(n_j / n_i)
                y = n_i * resolution_m * math.cos(n_j / n_i)
                points.append((x, y, n_k * resolution_m))
    return points
