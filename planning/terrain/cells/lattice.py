"""Where the corners of a raster's cells lie: a lattice of parallelograms, bent where a map projection bends it.

Coordinates: metres in the lattice's own frame, x along its rows of cells, y towards later rows. Neighbouring
cells share their corners, so that there is neither gap nor overlap between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from mapping.geometry.arrays import F64

_STEPS = 12
_SAME_PLACE_PX = 1e-10
_ROUNDING_M = 1e-9


class Lattice(NamedTuple):
    """Corner (row, column) lies at (column * width + row * shear, row * height) + bend."""

    width_m: float
    height_m: float
    shear_m: float
    bend_m: F64
    """(N, M, 2) x, y by which every ``node_px``-th corner is off; bilinear in between; (0, 0, 2): none is."""
    node_px: int
    first_row: int
    first_column: int
    """Of this part of a larger lattice, for looking up the bend."""


def straight(width_m: float, height_m: float, shear_m: float = 0.0) -> Lattice:
    """A lattice of equal cells."""
    return Lattice(float(width_m), float(height_m), float(shear_m), np.empty((0, 0, 2)), 1, 0, 0)


@njit(cache=True, inline="always")
def is_rectangular(lattice):
    """Whether every cell is [column, column + 1] * width by [row, row + 1] * height."""
    return lattice.shear_m == 0.0 and lattice.bend_m.shape[0] == 0


@njit(cache=True, nogil=True)
def bend_at(lattice, row, column):
    """(x, y) by which a place, in cells, is off the parallelograms."""
    nodes = lattice.bend_m
    if nodes.shape[0] == 0:
        return 0.0, 0.0
    v, u = (row + lattice.first_row) / lattice.node_px, (column + lattice.first_column) / lattice.node_px
    i = min(max(int(v), 0), nodes.shape[0] - 2)
    j = min(max(int(u), 0), nodes.shape[1] - 2)
    v, u = v - i, u - j
    a, b, c, d = (1.0 - v) * (1.0 - u), (1.0 - v) * u, v * (1.0 - u), v * u
    x = a * nodes[i, j, 0] + b * nodes[i, j + 1, 0] + c * nodes[i + 1, j, 0] + d * nodes[i + 1, j + 1, 0]
    y = a * nodes[i, j, 1] + b * nodes[i, j + 1, 1] + c * nodes[i + 1, j, 1] + d * nodes[i + 1, j + 1, 1]
    return x, y


@njit(cache=True, nogil=True)
def bend_range(lattice, row0, column0, row1, column1):
    """(x0, y0, x1, y1) that hold ``bend_at`` of all places of a block.

    Between lines of nodes it is bilinear: its extremes lie where those lines and the block's sides cross.
    """
    if lattice.bend_m.shape[0] == 0:
        return 0.0, 0.0, 0.0, 0.0
    px, first_row, first_column = lattice.node_px, lattice.first_row, lattice.first_column
    x0 = y0 = np.inf
    x1 = y1 = -np.inf
    row = row0
    while True:
        column = column0
        while True:
            x, y = bend_at(lattice, row, column)
            x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
            if column == column1:
                break
            column = min(column1, ((column + first_column) // px + 1) * px - first_column)
        if row == row1:
            break
        row = min(row1, ((row + first_row) // px + 1) * px - first_row)
    return x0 - _ROUNDING_M, y0 - _ROUNDING_M, x1 + _ROUNDING_M, y1 + _ROUNDING_M


@njit(cache=True, nogil=True)
def block_around(lattice, bend, row0, column0, row1, column1):
    """(x0, y0, x1, y1) that hold a block of cells, which are bent by no more than ``bend``, a ``bend_range``."""
    lean0, lean1 = row0 * lattice.shear_m, row1 * lattice.shear_m
    return (
        column0 * lattice.width_m + min(lean0, lean1) + bend[0],
        row0 * lattice.height_m + bend[1],
        column1 * lattice.width_m + max(lean0, lean1) + bend[2],
        row1 * lattice.height_m + bend[3],
    )


@njit(cache=True, nogil=True)
def corner(lattice, row, column):
    """(x, y) of the corner before cell (row, column); fractions give places inside the cells."""
    x, y = bend_at(lattice, row, column)
    return column * lattice.width_m + row * lattice.shear_m + x, row * lattice.height_m + y


@njit(cache=True, nogil=True)
def place_of(lattice, x, y):
    """(row, column) in cells of a place; the inverse of ``corner``."""
    off_x = off_y = 0.0
    row = column = 0.0
    for _ in range(_STEPS):
        before_row, before_column = row, column
        row = (y - off_y) / lattice.height_m
        column = (x - off_x - row * lattice.shear_m) / lattice.width_m
        if abs(row - before_row) + abs(column - before_column) < _SAME_PLACE_PX:
            break
        off_x, off_y = bend_at(lattice, row, column)
    return row, column


@njit(cache=True, nogil=True)
def quad_of(lattice, row, column):
    """(x0, y0, ... x3, y3) of a cell's corners, in turn; the cell lies to the same side of all its edges."""
    x0, y0 = corner(lattice, row, column)
    x1, y1 = corner(lattice, row, column + 1)
    x2, y2 = corner(lattice, row + 1, column + 1)
    x3, y3 = corner(lattice, row + 1, column)
    return x0, y0, x1, y1, x2, y2, x3, y3


@njit(cache=True, nogil=True, parallel=True)
def places_of(lattice, xy_m, out):
    """``place_of`` of (N, 2) places."""
    for k in prange(xy_m.shape[0]):
        out[k, 0], out[k, 1] = place_of(lattice, xy_m[k, 0], xy_m[k, 1])
