"""The first touch of a ray with a height field, by asking every column as a box."""

from __future__ import annotations

import math

import numpy as np

from planning.terrain.dsm import Dsm


def first_touch(
    dsm: Dsm, origin_m: np.ndarray, direction: np.ndarray, floor_alt_dsm_m: float
) -> tuple[float, bool] | None:
    """(t, known) of the nearest solid column, or of the floor below unknown terrain and outside."""
    best: tuple[float, bool] | None = None
    west, _, _, north = dsm.bounds_m
    for row in range(dsm.height_px):
        for col in range(dsm.width_px):
            height = float(dsm.elevation_m[row, col])
            if math.isnan(height):
                continue
            x0, y1 = west + col * dsm.resolution_m, north - row * dsm.resolution_m
            low = (x0, y1 - dsm.resolution_m, -math.inf)
            high = (x0 + dsm.resolution_m, y1, height)
            t = _enters(origin_m, direction, low, high)
            if t is not None and (best is None or t < best[0]):
                best = (t, True)
    floor = _enters(origin_m, direction, (-math.inf,) * 3, (math.inf, math.inf, floor_alt_dsm_m))
    if floor is not None and (best is None or floor < best[0]):
        best = (floor, False)
    return best


def _enters(origin: np.ndarray, direction: np.ndarray, low: tuple, high: tuple) -> float | None:
    enter, leave = 0.0, math.inf
    for axis in range(3):
        if direction[axis] == 0.0:
            if not low[axis] <= origin[axis] <= high[axis]:
                return None
            continue
        a, b = (low[axis] - origin[axis]) / direction[axis], (high[axis] - origin[axis]) / direction[axis]
        enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter if enter <= leave else None
