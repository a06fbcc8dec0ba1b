"""Block maxima of a height grid: downsampling that keeps every mast."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from planning.dsm import F32


@njit(cache=True, nogil=True, parallel=True)
def block_max_grid(source_m: F32, block_px: int) -> F32:
    """Highest known cell of each block of b x b cells; NaN where a block holds none.

    source_m: (H, W) float32, any layout. Returns (ceil(H / b), ceil(W / b)); blocks at the right and
    lower edge may be partial. Reads the source once and needs one row of memory per thread.
    """
    height, width = source_m.shape
    rows, cols = (height + block_px - 1) // block_px, (width + block_px - 1) // block_px
    out_m = np.empty((rows, cols), np.float32)
    for br in prange(rows):
        highest_m = np.full(cols * block_px, -np.inf, np.float32)
        for r in range(br * block_px, min(height, (br + 1) * block_px)):
            row = source_m[r]
            for c in range(width):
                # An ordered comparison is false for NaN: unknown cells drop out.
                highest_m[c] = row[c] if row[c] > highest_m[c] else highest_m[c]
        for bc in range(cols):
            best = np.float32(-np.inf)
            for v in highest_m[bc * block_px : (bc + 1) * block_px]:
                best = v if v > best else best
            out_m[br, bc] = best if best > -np.inf else np.nan
    return out_m
