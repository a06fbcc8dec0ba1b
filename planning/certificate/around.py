"""The cells around a place: how near and how far each of them reaches, and how high it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64
from planning.certificate.quads import away
from planning.terrain.cells.cells import Cells
from planning.terrain.cells.lattice import is_rectangular, quad_of


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
    block: tuple[slice, slice]
    """Its rows and columns among the model's cells."""


def cells_around(cells: Cells, xy_m: tuple[float, float], radius_m: float) -> CellsAround:
    """The cells within ``radius_m`` of a projected place, and those between them."""
    x, y = cells.layout.in_frame(np.array([xy_m]))[0]
    place = np.array(xy_m)
    rows, columns = cells.layout.reach(place - radius_m, place + radius_m)
    height_m = cells.elevation_m[rows, columns].astype(np.float64)
    near_m, far_m = np.empty(height_m.shape), np.empty(height_m.shape)
    measure = _of_rectangles if is_rectangular(cells.layout.lattice) else _of_quads
    measure(cells.layout.lattice, rows.start, columns.start, x, y, near_m, far_m)
    return CellsAround(height_m, near_m, far_m, _holds(cells, place, radius_m), (rows, columns))


def _holds(cells: Cells, xy_m: F64, radius_m: float) -> bool:
    """Whether a square around a place lies in the model."""
    corners = xy_m + radius_m * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1), (0, 0)])
    places = cells.layout.places(corners)
    return bool((places >= 0.0).all() and (places <= np.array(cells.elevation_m.shape)).all())


@njit(cache=True, nogil=True)
def _of_rectangles(lattice, row0, column0, x, y, near_m, far_m):
    rows, columns = near_m.shape
    near_x, far_x = _along_side(column0, columns, lattice.width_m, x)
    near_y, far_y = _along_side(row0, rows, lattice.height_m, y)
    for i in range(rows):
        for j in range(columns):
            near_m[i, j], far_m[i, j] = np.sqrt(near_x[j] + near_y[i]), np.sqrt(far_x[j] + far_y[i])


@njit(cache=True, nogil=True)
def _along_side(first, count, side_m, x):
    """Squared distances, along one axis, to the nearest and the farthest point of each cell."""
    near, far = np.empty(count), np.empty(count)
    for k in range(count):
        before, after = (first + k) * side_m - x, x - (first + k + 1) * side_m
        near[k], far[k] = max(0.0, max(before, after)) ** 2, max(before * before, after * after)
    return near, far


@njit(cache=True, nogil=True)
def _of_quads(lattice, row0, column0, x, y, near_m, far_m):
    for i in range(near_m.shape[0]):
        for j in range(near_m.shape[1]):
            quad = quad_of(lattice, row0 + i, column0 + j)
            off_x, off_y = away(quad, x, y)
            near_m[i, j] = np.sqrt(off_x * off_x + off_y * off_y)
            far = 0.0
            for k in range(4):
                far = max(far, (quad[2 * k] - x) ** 2 + (quad[2 * k + 1] - y) ** 2)
            far_m[i, j] = np.sqrt(far)
