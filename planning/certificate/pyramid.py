"""A pyramid of largest elevations, so that far or low terrain is skipped without being looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from mapping.geometry.arrays import F32, F64, I64
from planning.terrain.cells.cells import Cells
from planning.terrain.cells.lattice import Lattice, bend_range, block_around, is_rectangular, place_of, straight

LEAF_PX = 8
"""Cells per side of the blocks at the pyramid's lowest level."""


@dataclass(frozen=True, slots=True)
class MaxPyramid:
    """Largest elevation of blocks of cells; +inf where a block holds an unknown cell.

    Level 0 has blocks of ``LEAF_PX`` cells, every further level doubles their side; the last level is
    one block.
    """

    elevation_m: F32
    """(H, W) the cells themselves; not finite = unknown."""
    maxima_m: F32
    """All levels one after the other, each row by row."""
    layout: I64
    """(L, 3) offset into ``maxima_m``, rows and columns of each level."""
    lattice: Lattice
    """Where the cells lie."""
    boxes_m: F64
    """(B, 4) x0, y0, x1, y1 around each block of ``maxima_m``; (0, 4) where cells are rectangles."""


def max_pyramid(elevation_m: F32, resolution_m: float) -> MaxPyramid:
    """Build the pyramid over a whole (H, W) model of squares; costs one pass over it and 1/48 of its memory."""
    return _pyramid(elevation_m, straight(resolution_m, resolution_m))


def cells_pyramid(cells: Cells) -> MaxPyramid:
    """The same over the cells of any raster, in the frame of their layout."""
    return _pyramid(cells.elevation_m, cells.layout.lattice)


def _pyramid(elevation_m: F32, lattice: Lattice) -> MaxPyramid:
    shape = tuple(-(-side // LEAF_PX) for side in elevation_m.shape)
    levels = [np.empty(shape, dtype=np.float32)]
    _block_maxima(elevation_m, levels[0])
    while levels[-1].size > 1:
        levels.append(_halved(levels[-1]))
    sizes = np.array([level.size for level in levels])
    layout = np.array([level.shape for level in levels])
    offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    flat = np.concatenate([level.ravel() for level in levels])
    flat_layout = np.column_stack([offsets, layout]).astype(np.int64)
    boxes = np.empty((0 if is_rectangular(lattice) else flat.size, 4))
    _block_boxes(lattice, elevation_m.shape[0], elevation_m.shape[1], flat_layout, boxes)
    return MaxPyramid(elevation_m, flat, flat_layout, lattice, boxes)


def _halved(level_m: NDArray[np.floating]) -> NDArray[np.floating]:
    rows, cols = level_m.shape
    padded = np.pad(level_m, ((0, rows % 2), (0, cols % 2)), mode="edge")
    return padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2).max(axis=(1, 3))


@njit(cache=True, parallel=True, nogil=True)
def _block_maxima(elevation_m, out):
    height, width = elevation_m.shape
    for i in prange(out.shape[0]):
        out[i, :] = -np.inf
        for r in range(i * LEAF_PX, min(height, (i + 1) * LEAF_PX)):
            for j in range(out.shape[1]):
                largest = out[i, j]
                for c in range(j * LEAF_PX, min(width, (j + 1) * LEAF_PX)):
                    e = elevation_m[r, c]
                    if not np.isfinite(e):
                        largest = np.inf
                    elif e > largest:
                        largest = e
                out[i, j] = largest


@njit(cache=True, nogil=True)
def _block_boxes(lattice, height, width, layout, out):
    """All levels: the lowest from where its cells lie, the others from those below them."""
    for level in range(layout.shape[0] if out.shape[0] else 0):
        offset, rows, columns = layout[level, 0], layout[level, 1], layout[level, 2]
        for i in range(rows):
            for j in range(columns):
                if level == 0:
                    r0, c0 = i * LEAF_PX, j * LEAF_PX
                    r1, c1 = min(height, r0 + LEAF_PX), min(width, c0 + LEAF_PX)
                    box = block_around(lattice, bend_range(lattice, r0, c0, r1, c1), r0, c0, r1, c1)
                else:
                    box = _around_children(out, layout[level - 1], i, j)
                k = offset + i * columns + j
                out[k, 0], out[k, 1], out[k, 2], out[k, 3] = box


@njit(cache=True, nogil=True)
def _around_children(boxes_m, below, i, j):
    """The box around those of the blocks that block (i, j) has in the level below."""
    x0 = y0 = np.inf
    x1 = y1 = -np.inf
    for ci in range(2 * i, min(below[1], 2 * i + 2)):
        for cj in range(2 * j, min(below[2], 2 * j + 2)):
            box = boxes_m[below[0] + ci * below[2] + cj]
            x0, y0, x1, y1 = min(x0, box[0]), min(y0, box[1]), max(x1, box[2]), max(y1, box[3])
    return x0, y0, x1, y1


@njit(cache=True, nogil=True)
def block_box(lattice, boxes_m, offset, columns, level, i, j):
    """(x0, y0, x1, y1) around block (i, j) of a level."""
    if boxes_m.shape[0] > 0:
        k = offset + i * columns + j
        return boxes_m[k, 0], boxes_m[k, 1], boxes_m[k, 2], boxes_m[k, 3]
    side = LEAF_PX * 2.0**level
    wide, high = side * lattice.width_m, side * lattice.height_m
    return j * wide, i * high, (j + 1) * wide, (i + 1) * high


@njit(cache=True, nogil=True)
def edge_distance(lattice, rows, columns, x, y):
    """Distance of a place inside the model to the outside, 0 outside.

    Where cells are no rectangles, inf inside: a ring of unknown cells stands for the outside there.
    """
    if is_rectangular(lattice):
        return max(0.0, min(min(x, columns * lattice.width_m - x), min(y, rows * lattice.height_m - y)))
    row, column = place_of(lattice, x, y)
    return np.inf if 0.0 < row < rows and 0.0 < column < columns else 0.0


@njit(cache=True, inline="always")
def column_top(elevation_m, row, column):
    """Of one cell's column: an unknown cell reaches up forever."""
    top = np.float64(elevation_m[row, column])
    return top if np.isfinite(top) else np.inf


@njit(cache=True, inline="always")
def leaf_end(elevation_m, lattice, row0, column0):
    """(past-the-last row, past-the-last column, bend) of the cells of a leaf."""
    row = min(elevation_m.shape[0], row0 + LEAF_PX)
    column = min(elevation_m.shape[1], column0 + LEAF_PX)
    return row, column, bend_range(lattice, row0, column0, row, column)


@njit(cache=True, inline="always")
def below(layout, level, i, j):
    """Offset and columns of the level below a block's, and the rows and columns of its blocks there."""
    offset, rows, columns = layout[level - 1, 0], layout[level - 1, 1], layout[level - 1, 2]
    return offset, columns, range(2 * i, min(rows, 2 * i + 2)), range(2 * j, min(columns, 2 * j + 2))
