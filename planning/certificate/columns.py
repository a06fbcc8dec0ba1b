"""Whether a vehicle can climb and descend over a place: the ground around it must be free.

Every cell within the vehicle's radius plus its position error must be known and may rise above the
place's own ground by 0.5 m (grass, stones, the landing gear's length) or by what a slope of 35 degrees
rises up to the cell's far corner, whichever is more. Any plane slope up to 35 degrees passes at any
resolution; a wall, a mast, a tree or an unknown cell does not, and neither does the model's edge.
"""

from __future__ import annotations

import math

import numpy as np

from planning.certificate.around import cells_around
from planning.dsm import Dsm

FREE_RISE_M = 0.5
FREE_SLOPE = math.tan(math.radians(35.0))


def column_obstacle(dsm: Dsm, xy_m: tuple[float, float], radius_m: float) -> str | None:
    """What blocks the column over the projected place ``xy_m``, in words; None when it is clear."""
    around = cells_around(dsm.cells, xy_m, radius_m)
    if not around.inside:
        return f"the surface model ends within {radius_m:.2f} m"
    if not np.isfinite(around.height_m).all():
        return f"the surface model has unknown cells within {radius_m:.2f} m"
    ground_m = dsm.elevation_at(np.array([xy_m]))[0]
    rise_m = around.height_m - ground_m
    blocked = rise_m > np.maximum(FREE_RISE_M, FREE_SLOPE * around.far_m)
    if not blocked.any():
        return None
    worst = int(np.argmax(np.where(blocked, rise_m, -np.inf)))
    return f"the surface rises {rise_m[worst]:.1f} m at {around.near_m[worst]:.1f} m from it"
