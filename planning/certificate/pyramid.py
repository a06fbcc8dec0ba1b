"""A pyramid of largest elevations, so that far or low terrain is skipped without being looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from planning.cells.cells import Cells
from planning.cells.lattice import Lattice, corner, is_rectangular, place_of, straight

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

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
    boxes = np.empty((0, 4)) if is_rectangular(lattice) else _all_boxes(lattice, elevation_m.shape, len(levels))
    return MaxPyramid(elevation_m, flat, np.column_stack([offsets, layout]).astype(np.int64), lattice, boxes)


def _halved(level_m: NDArray[np.floating]) -> NDArray[np.floating]:
    rows, cols = level_m.shape
    padded = np.pad(level_m, ((0, rows % 2), (0, cols % 2)), mode="edge")
    return padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2).max(axis=(1, 3))


def _all_boxes(lattice: Lattice, shape: tuple[int, int], levels: int) -> F64:
    """(B, 4) of all levels: the lowest from the cells' corners, the others from those below them."""
    least = np.empty((*(-(-side // LEAF_PX) for side in shape), 4))
    _block_boxes(lattice, shape[0], shape[1], least)
    sides: list[NDArray[np.floating]] = [np.concatenate([-least[..., :2], least[..., 2:]], axis=2)]
    while len(sides) < levels:
        sides.append(np.stack([_halved(sides[-1][..., k]) for k in range(4)], axis=2))
    flat = np.concatenate([side.reshape(-1, 4) for side in sides])
    return np.concatenate([-flat[:, :2], flat[:, 2:]], axis=1, dtype=np.float64)


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


@njit(cache=True, parallel=True, nogil=True)
def _block_boxes(lattice, height, width, out):
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            x0 = y0 = np.inf
            x1 = y1 = -np.inf
            for r in range(i * LEAF_PX, min(height, (i + 1) * LEAF_PX) + 1):
                for c in range(j * LEAF_PX, min(width, (j + 1) * LEAF_PX) + 1):
                    x, y = corner(lattice, r, c)
                    x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
            out[i, j, 0], out[i, j, 1], out[i, j, 2], out[i, j, 3] = x0, y0, x1, y1


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
