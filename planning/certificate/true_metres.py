"""How many metres of a model's map projection a metre on the ground may have."""

from __future__ import annotations

import math

import numpy as np
from pyproj import Proj

from mapping.geometry.arrays import F64
from planning.terrain.cells.cells import Cells
from planning.terrain.dsm import Dsm

SCALE_TOLERANCE = 0.01
"""Largest deviation of the CRS's metre from the true one."""


def true_cells(dsm: Dsm, xy_m: F64) -> Cells:
    """The model's cells in metres no longer than those on the ground at any of the projected (N, 2) places."""
    return dsm.cells.measured_in(stretch_at(dsm, xy_m))


def stretch_at(dsm: Dsm, xy_m: F64) -> float:
    """Metres of the CRS in a metre on the ground, in the direction and at the place where they are most; 1 at least.

    Where they are fewer than one, distances are longer on the ground than in the CRS, in which they are judged then.
    More than are tolerated at all are not counted: such a model is refused.
    """
    lat_deg, lon_deg = dsm.lat_lon_from_xy(xy_m).T
    longest = float(np.max(Proj(dsm.crs).get_factors(lon_deg, lat_deg).tissot_semimajor))
    return min(max(1.0, longest), 1.0 + SCALE_TOLERANCE) if math.isfinite(longest) else 1.0
