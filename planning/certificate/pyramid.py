"""A pyramid of largest elevations, so that far or low terrain is skipped without being looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

F32 = NDArray[np.float32]
I64 = NDArray[np.int64]

LEAF_PX = 8
"""Cells per side of the blocks at the pyramid's lowest level."""


@dataclass(frozen=True, slots=True)
class MaxPyramid:
    """Largest elevation of square blocks; +inf where a block holds an unknown cell.

    Level 0 has blocks of ``LEAF_PX`` cells, every further level doubles their side; the last level is
    one block.
    """

    elevation_m: F32
    """(H, W) the cells themselves; not finite = unknown."""
    maxima_m: F32
    """All levels one after the other, each row by row."""
    layout: I64
    """(L, 3) offset into ``maxima_m``, rows and columns of each level."""
    resolution_m: float


def max_pyramid(elevation_m: F32, resolution_m: float) -> MaxPyramid:
    """Build the pyramid over a whole (H, W) model; costs one pass over it and 1/48 of its memory."""
    shape = tuple(-(-side // LEAF_PX) for side in elevation_m.shape)
    levels = [np.empty(shape, dtype=np.float32)]
    _block_maxima(elevation_m, levels[0])
    while levels[-1].size > 1:
        levels.append(_halved(levels[-1]))
    sizes = np.array([level.size for level in levels])
    layout = np.array([level.shape for level in levels])
    offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    flat = np.concatenate([level.ravel() for level in levels])
    return MaxPyramid(elevation_m, flat, np.column_stack([offsets, layout]).astype(np.int64), resolution_m)


def _halved(level_m: F32) -> F32:
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
