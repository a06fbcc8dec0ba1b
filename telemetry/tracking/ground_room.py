"""How far the vehicle may fly level in each direction before known ground comes too near: what is unknown is ground."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import maximum_filter

from mapping.geometry.arrays import F64
from mapping.perceiving.ground import GroundGrid

DIRECTIONS, FARTHEST_M, STEP_M = 120, 40.0, 0.5
COARSE_M = 1.0
"""Cells are taken together to so much, and each counts as high as its highest neighbour: no direction misses a spike,
and what is beside the way is kept away from as well."""


class GroundRoom:
    """Keeps the coarse ground of the newest surface model."""

    def __init__(self) -> None:
        self._of: GroundGrid | None = None
        self._top_m: F64 = np.empty((0, 0))
        self._to_cell: F64 = np.empty((2, 3))

    def around(self, ground: GroundGrid | None, position_enu_m: F64, keep_m: float) -> tuple[float, ...]:
        """(120,) metres clockwise from north, at most ``FARTHEST_M``; empty without a surface model.

        ``keep_m``: between the vehicle's middle and the ground below it.
        """
        if ground is None:
            return ()
        if ground is not self._of:
            self._take(ground)
        bearing = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
        along_m = np.arange(STEP_M, FARTHEST_M + STEP_M / 2, STEP_M)
        east = position_enu_m[0] + np.sin(bearing)[:, None] * along_m
        north = position_enu_m[1] + np.cos(bearing)[:, None] * along_m
        blocked = self._up_m(east, north) > position_enu_m[2] - keep_m
        first = np.where(blocked.any(axis=1), blocked.argmax(axis=1), len(along_m))
        return tuple((first * STEP_M).tolist())

    def _take(self, ground: GroundGrid) -> None:
        together = max(1, math.ceil(COARSE_M / ground.cell_m))
        up = np.where(np.isnan(ground.up_m), np.inf, ground.up_m).astype(np.float64)
        rows, cols = (-(-size // together) for size in up.shape)
        padded = np.full((rows * together, cols * together), np.inf)
        padded[: up.shape[0], : up.shape[1]] = up
        pooled = padded.reshape(rows, together, cols, together).max(axis=(1, 3))
        self._top_m = maximum_filter(pooled, size=3, mode="constant", cval=np.inf)
        self._to_cell = ground.enu_to_cell / together
        self._of = ground

    def _up_m(self, east: F64, north: F64) -> F64:
        cell = self._to_cell
        row = np.floor(cell[0, 0] * east + cell[0, 1] * north + cell[0, 2]).astype(np.int64)
        col = np.floor(cell[1, 0] * east + cell[1, 1] * north + cell[1, 2]).astype(np.int64)
        rows, cols = self._top_m.shape
        inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        return np.where(inside, self._top_m[np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)], np.inf)
