"""Point clouds made smaller on board: one point per voxel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
_REACH = 1 << 20
"""Voxels to each side of the origin that a key can tell apart."""


def thinned(xyz_m: F32, voxel_m: float) -> F32:
    """One of the points (N, 3) in each voxel, the first; points without a number are left out. 0: all others stay."""
    known = xyz_m[np.isfinite(xyz_m).all(axis=1)]
    if voxel_m <= 0.0 or not len(known):
        return known
    cells = np.clip(np.floor(known / np.float32(voxel_m)), -_REACH, _REACH - 1).astype(np.int64) + _REACH
    keys = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    _, first = np.unique(keys, return_index=True)
    return known[np.sort(first)]
