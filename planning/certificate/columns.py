"""Whether a vehicle can climb and descend over a place: the ground around it must be free.

Every cell within the vehicle's radius plus its position error must be known and may rise above the
place's own ground by 0.5 m (grass, stones, the landing gear's length) or by what a slope of 35 degrees
rises up to the cell's far corner, whichever is more. Any plane slope up to 35 degrees passes at any
resolution; a wall, a mast, a tree or an unknown cell does not, and neither does the model's edge.
"""

from __future__ import annotations

import math

import numpy as np

from planning.dsm import Dsm

FREE_RISE_M = 0.5
FREE_SLOPE = math.tan(math.radians(35.0))


def column_obstacle(dsm: Dsm, xy_m: tuple[float, float], radius_m: float) -> str | None:
    """What blocks the column over the projected place ``xy_m``, in words; None when it is clear."""
    x, y, res = xy_m[0] - dsm.transform.c, dsm.transform.f - xy_m[1], dsm.resolution_m
    row0, row1 = math.floor((y - radius_m) / res), math.floor((y + radius_m) / res) + 1
    col0, col1 = math.floor((x - radius_m) / res), math.floor((x + radius_m) / res) + 1
    if row0 < 0 or col0 < 0 or row1 > dsm.height_px or col1 > dsm.width_px:
        return f"the surface model ends within {radius_m:.2f} m"
    left = np.arange(col0, col1)[None, :] * res - x
    top = np.arange(row0, row1)[:, None] * res - y
    near_m = np.hypot(_outside(left, res), _outside(top, res))
    far_m = np.hypot(_farther(left, res), _farther(top, res))
    cells = dsm.elevation_m[row0:row1, col0:col1].astype(np.float64)
    reached = near_m <= radius_m
    if not np.isfinite(cells[reached]).all():
        return f"the surface model has unknown cells within {radius_m:.2f} m"
    ground_m = cells[math.floor(y / res) - row0, math.floor(x / res) - col0]
    rise_m = cells - ground_m
    blocked = reached & (rise_m > np.maximum(FREE_RISE_M, FREE_SLOPE * far_m))
    if not blocked.any():
        return None
    worst = np.unravel_index(np.argmax(np.where(blocked, rise_m, -np.inf)), rise_m.shape)
    return f"the surface rises {rise_m[worst]:.1f} m at {near_m[worst]:.1f} m from it"


def _outside(low: np.ndarray, res: float) -> np.ndarray:
    """Distance from 0 to the interval [low, low + res]."""
    return np.maximum(0.0, np.maximum(low, -(low + res)))


def _farther(low: np.ndarray, res: float) -> np.ndarray:
    """Distance from 0 to the farther end of [low, low + res]."""
    return np.maximum(np.abs(low), np.abs(low + res))
