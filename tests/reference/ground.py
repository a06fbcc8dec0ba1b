"""Distance to a surface model, and what a radar sees of it, written slowly."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64


def shell_distance(up_m: F64, enu_to_cell: F64, cell_m: float, point_enu: F64) -> float:
    """Smallest distance of a point to the surface: each cell's top and its wall down to its lowest neighbour."""
    row, col = enu_to_cell @ [point_enu[0], point_enu[1], 1.0]
    best = math.inf
    rows, cols = up_m.shape
    for r in range(rows):
        for c in range(cols):
            if math.isnan(up_m[r, c]):
                continue
            around = up_m[max(0, r - 1) : r + 2, max(0, c - 1) : c + 2]
            foot = float(np.nanmin(around))
            out_r = max(r - row, 0.0, row - (r + 1)) * cell_m
            out_c = max(c - col, 0.0, col - (c + 1)) * cell_m
            out_u = max(foot - point_enu[2], 0.0, point_enu[2] - up_m[r, c])
            best = min(best, math.sqrt(out_r**2 + out_c**2 + out_u**2))
    return best


def flat_ground_gap(height_m: float, range_m: float, slack_m: float, gate_low_rad: float) -> float:
    """How far below a level gate flat ground lies, for a radar ``height_m`` above it: the farthest edge of the cell."""
    farthest = range_m + slack_m
    if farthest <= height_m:
        return math.inf
    return gate_low_rad + math.asin(height_m / farthest)


def flat_ground_area(height_m: float, near_m: float, far_m: float, width_rad: float, down_6db_rad: float) -> float:
    """Area across the line of sight of flat ground between two ranges, weighted by the gain, by summing thin rings."""
    steps = 2000
    near_m = max(near_m, height_m)
    total = 0.0
    for k in range(steps):
        r0 = near_m + (far_m - near_m) * k / steps
        r1 = near_m + (far_m - near_m) * (k + 1) / steps
        elevation = -math.asin(height_m / ((r0 + r1) / 2))
        thick = math.asin(height_m / r0) - math.asin(height_m / r1)
        away = (r0 + r1) / 2
        total += thick * away * width_rad * away * 10 ** (-1.2 * (elevation / down_6db_rad) ** 2)
    return total
