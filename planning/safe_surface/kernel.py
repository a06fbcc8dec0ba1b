"""Grey dilation with a non-flat element that is symmetric in rows and columns (Melita 2020, eq. 2).

The image is worked in tiles that stay in the second-level cache. Inside a tile each output row first
merges the source rows dy above and dy below (the element weighs them alike), then merges columns dx to
the left and right the same way: a quarter of the element's cells is left, in loops over contiguous
columns that the compiler turns into vector instructions.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from mapping.geometry.arrays import F32, I64

UNKNOWN = np.float32(-1e30)
"""Stands for eq. 2's -inf: finite, so that adding a weight to it is harmless in every comparison."""
_KNOWN_ABOVE = np.float32(-1e29)
PAIRS = 4
"""Column pairs merged per sweep; each row of weights is padded to a multiple of it with UNKNOWN."""
_TILE_ROWS, _TILE_COLS = 32, 1024


@njit(cache=True, nogil=True)
def _load_tile(source_m: F32, row0: int, col0: int, tile_m: F32) -> bool:
    """Copy the part of the source at (row0, col0), UNKNOWN outside and for NaN; whether anything is known.

    Heights stay as they are: one float32 rounding of cell + weight is all that separates the result from
    eq. 2, since rounding never changes which sum is the largest.
    """
    r0, r1 = max(0, row0), min(source_m.shape[0], row0 + tile_m.shape[0])
    c0, c1 = max(0, col0), min(source_m.shape[1], col0 + tile_m.shape[1])
    tile_m[:] = UNKNOWN
    any_known = False
    for r in range(r0, r1):
        row, out = source_m[r, c0:c1], tile_m[r - row0, c0 - col0 : c1 - col0]
        for c in range(row.size):
            v = row[c]
            any_known |= v == v
            out[c] = v if v == v else UNKNOWN
    return any_known


@njit(cache=True, nogil=True)
def _merge_pairs(merged_m: F32, weights_m: F32, dx: int, halo: int, best_m: F32) -> None:
    """Raise ``best_m`` by the columns dx .. dx + 3 to both sides."""
    n = best_m.size
    l0, r0 = merged_m[halo - dx : halo - dx + n], merged_m[halo + dx : halo + dx + n]
    l1, r1 = merged_m[halo - dx - 1 : halo - dx - 1 + n], merged_m[halo + dx + 1 : halo + dx + 1 + n]
    l2, r2 = merged_m[halo - dx - 2 : halo - dx - 2 + n], merged_m[halo + dx + 2 : halo + dx + 2 + n]
    l3, r3 = merged_m[halo - dx - 3 : halo - dx - 3 + n], merged_m[halo + dx + 3 : halo + dx + 3 + n]
    w0, w1, w2, w3 = weights_m[dx], weights_m[dx + 1], weights_m[dx + 2], weights_m[dx + 3]
    for x in range(n):
        a = (l0[x] if l0[x] > r0[x] else r0[x]) + w0
        b = (l1[x] if l1[x] > r1[x] else r1[x]) + w1
        c = (l2[x] if l2[x] > r2[x] else r2[x]) + w2
        d = (l3[x] if l3[x] > r3[x] else r3[x]) + w3
        a = a if a > b else b
        c = c if c > d else d
        a = a if a > c else c
        best_m[x] = a if a > best_m[x] else best_m[x]  # Melita 2020, eq. 2


@njit(cache=True, nogil=True)
def _dilate_row(tile_m: F32, centre: int, weights_m: F32, pairs: I64, merged_m: F32, best_m: F32) -> None:
    """Eq. 2 for one row of a tile; ``centre`` is its row in the tile."""
    halo = (merged_m.size - best_m.size) // 2
    best_m[:] = UNKNOWN
    for dy in range(pairs.size):
        up, down = tile_m[centre - dy], tile_m[centre + dy]
        for x in range(merged_m.size):
            merged_m[x] = up[x] if up[x] > down[x] else down[x]
        for dx in range(0, pairs[dy], PAIRS):
            _merge_pairs(merged_m, weights_m[dy], dx, halo, best_m)


@njit(cache=True, nogil=True, parallel=True)
def dilate_grid(source_m: F32, weights_m: F32, pairs: I64) -> F32:
    """max over (dy, dx) of ``source[y + dy, x + dx] + weights[|dy|, |dx|]`` (Melita 2020, eq. 2).

    source_m: (H, W) float32, C-contiguous, NaN where unknown. weights_m: (D, P) metres, padded with
    ``UNKNOWN``; pairs: (D,) how many columns of each row count, a multiple of ``PAIRS``. Returns (H, W),
    NaN where no known cell is in reach.
    """
    height, width = source_m.shape
    halo_y, halo_x = pairs.size - 1, weights_m.shape[1]
    tile_w = min(_TILE_COLS, width)
    across = (width + tile_w - 1) // tile_w
    down = (height + _TILE_ROWS - 1) // _TILE_ROWS
    out_m = np.empty((height, width), np.float32)
    for tile in prange(across * down):
        row0, col0 = (tile // across) * _TILE_ROWS, (tile % across) * tile_w
        rows, cols = min(_TILE_ROWS, height - row0), min(tile_w, width - col0)
        tile_m = np.empty((rows + 2 * halo_y, cols + 2 * halo_x), np.float32)
        if not _load_tile(source_m, row0 - halo_y, col0 - halo_x, tile_m):
            out_m[row0 : row0 + rows, col0 : col0 + cols] = np.nan
            continue
        merged_m, best_m = np.empty(cols + 2 * halo_x, np.float32), np.empty(cols, np.float32)
        for r in range(rows):
            _dilate_row(tile_m, r + halo_y, weights_m, pairs, merged_m, best_m)
            out_row = out_m[row0 + r, col0 : col0 + cols]
            for x in range(cols):
                out_row[x] = best_m[x] if best_m[x] > _KNOWN_ABOVE else np.nan
    return out_m
