"""Point clouds on board: what cannot be sent is left out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]


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
