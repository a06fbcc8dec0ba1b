"""What has changed in a map since a revision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Changes:
    """Voxels as they are now, each once. Who has the map of ``revision`` before and puts these in has it as it is."""

    keys: NDArray[np.int32]
    """(N, 3) floor(enu / resolution)"""
    probability: NDArray[np.float32]
    """(N,)"""
    explained: NDArray[np.bool_]
    """(N,)"""
    revision: int
    """To ask from the next time."""
    whole: bool
    """These are all voxels there are: forget what came before."""
