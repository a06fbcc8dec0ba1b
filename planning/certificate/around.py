"""The cells around a place: how near and how far each of them reaches, and how high it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planning.cells.cells import Cells
from planning.cells.lattice import quad_of
from planning.certificate.quads import quad_distance_sq

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CellsAround:
    """The (R, C) block of cells that holds every one of which a part lies within a radius of a place."""

    height_m: F64
    """NaN where unknown"""
    near_m: F64
    """Horizontal distance of the cell's nearest point"""
    far_m: F64
    """Of its farthest corner"""
    inside: bool
    """Whether the model reaches as far as the radius all around."""


def cells_around(cells: Cells, xy_m: tuple[float, float], radius_m: float) -> CellsAround:
    """The cells within ``radius_m`` of a projected place, and those between them."""
    x, y = cells.layout.in_frame(np.array([xy_m]))[0]
    place = np.array(xy_m)
    rows, columns = cells.layout.reach(place - radius_m, place + radius_m)
    height_m = cells.elevation_m[rows, columns].astype(np.float64)
    near_m, far_m = np.empty(height_m.shape), np.empty(height_m.shape)
    _distances(cells.layout.lattice, rows.start, columns.start, x, y, near_m, far_m)
    return CellsAround(height_m, near_m, far_m, _holds(cells, place, radius_m))


def _holds(cells: Cells, xy_m: F64, radius_m: float) -> bool:
    """Whether a square around a place lies in the model."""
    corners = xy_m + radius_m * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1), (0, 0)])
    places = cells.layout.places(corners)
    return bool((places >= 0.0).all() and (places <= np.array(cells.elevation_m.shape)).all())


@njit(cache=True, nogil=True)
def _distances(lattice, row0, column0, x, y, near_m, far_m):
    for i in range(near_m.shape[0]):
        for j in range(near_m.shape[1]):
            quad = quad_of(lattice, row0 + i, column0 + j)
            sq, _ = quad_distance_sq(x, y, 0.0, 0.0, 0.0, 0.0, quad, np.inf)
            far = 0.0
            for k in range(4):
                far = max(far, (quad[2 * k] - x) ** 2 + (quad[2 * k + 1] - y) ** 2)
            near_m[i, j], far_m[i, j] = np.sqrt(sq), np.sqrt(far)
