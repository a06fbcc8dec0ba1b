"""Point clouds made smaller on board: what cannot be sent is left out, of the rest one point per voxel stays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
_REACH = 1 << 20
"""Voxels to each side of the origin that a key can tell apart."""


class Sendable(NamedTuple):
    """The points (N, 3) that can be sent, and how many cannot."""

    xyz_m: F32
    not_finite: int
    out_of_reach: int


def sendable(xyz_m: F32, reach_m: float) -> Sendable:
    """Points whose coordinates are numbers, and none of them beyond ``reach_m``."""
    known = xyz_m[np.isfinite(xyz_m).all(axis=1)]
    near = known[(np.abs(known) <= np.float32(reach_m)).all(axis=1)]
    return Sendable(near, len(xyz_m) - len(known), len(known) - len(near))


def thinned(xyz_m: F32, voxel_m: float) -> F32:
    """One of the finite points (N, 3) in each voxel, the first. 0: all stay."""
    if voxel_m <= 0.0 or not len(xyz_m):
        return xyz_m
    cells = np.clip(np.floor(xyz_m / np.float32(voxel_m)), -_REACH, _REACH - 1).astype(np.int64) + _REACH
    keys = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    _, first = np.unique(keys, return_index=True)
    return xyz_m[np.sort(first)]
