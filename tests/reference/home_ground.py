"""Where a vehicle can stand, written slowly: every pair of cells that its hull may cover at once."""

from __future__ import annotations

import itertools
import math

import numpy as np

from mapping.geometry.arrays import F32


def nearest_m(row: int, col: int, x: float, y: float, res: float) -> float:
    """Distance of the place (x east, y south of the corner) to a cell."""
    dx = max(col * res - x, 0.0, x - (col + 1) * res)
    dy = max(row * res - y, 0.0, y - (row + 1) * res)
    return math.hypot(dx, dy)


def stand(cells: F32, res: float, x: float, y: float, centre_m: float, radius_m: float) -> tuple[bool, float, float]:
    """(whether a vehicle can start there, lowest, highest cell in reach); (False, nan, nan) where unknown."""
    reach_m = centre_m + radius_m
    height, width = cells.shape
    if min(x, y, width * res - x, height * res - y) < reach_m:
        return False, math.nan, math.nan
    every = list(itertools.product(range(height), range(width)))
    near = {(r, c): nearest_m(r, c, x, y, res) for r, c in every}
    reached = [at for at in every if near[at] <= reach_m]
    heights = np.array([cells[at] for at in reached], dtype=np.float64)
    if np.isnan(heights).any():
        return False, math.nan, math.nan
    clear = True
    for (r, c), (s, d) in itertools.product([at for at in reached if near[at] <= centre_m], reached):
        apart = res * math.hypot(max(0, abs(s - r) - 1), max(0, abs(d - c) - 1))
        free = max(1.0, math.tan(math.radians(35.0)) * res * math.hypot(s - r, d - c))
        if apart <= radius_m and abs(float(cells[r, c]) - float(cells[s, d])) > free + 1e-4:
            clear = False
    return clear, float(heights.min()), float(heights.max())
