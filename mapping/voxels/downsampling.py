"""Point clouds made smaller: of the points in each voxel one stays."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F32

_REACH = 1 << 20
"""Voxels to each side of the origin that a key can tell apart."""


def thinned(xyz_m: F32, voxel_m: float) -> F32:
    """One of the finite points (N, 3) in each voxel, the first. 0: all stay."""
    if voxel_m <= 0.0 or not len(xyz_m):
        return xyz_m
    cells = np.clip(np.floor(xyz_m / np.float32(voxel_m)), -_REACH, _REACH - 1).astype(np.int64) + _REACH
    keys = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    _, first = np.unique(keys, return_index=True)
    return xyz_m[np.sort(first)]
