"""Columns that stood in the way ahead, and whether each has been seen to be free at the vehicle's height since.

What a sensor does not see is not clear: it may be too near, or beside its beam. A column that was occupied is taken for
occupied at all heights until several frames have looked at it and found nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, I64, Bools
from mapping.geometry.poses import Pose

LOOKS = 3
"""One empty frame may be a drop-out."""
MOST_COLUMNS = 5_000
"""The newest: others are far behind."""


@dataclass(frozen=True, slots=True)
class Way:
    """What lies ahead, as seen from above: a sector, and a strip as wide as the vehicle."""

    depth_m: float
    half_angle_rad: float
    half_width_m: float
    height_m: float


@dataclass(frozen=True, slots=True)
class Field:
    """Where a sensor sees at the vehicle's own height."""

    nearest_m: float
    aside_rad: float

    def sees(self, nearest_m: F64, aside_rad: F64) -> Bools:
        """(N,) Which of things at these smallest ranges and directions (clockwise from the nose)."""
        return (nearest_m >= self.nearest_m) & (np.abs(aside_rad) <= self.aside_rad)


class Remembered:
    """Of one map, with voxels of ``edge_m``."""

    def __init__(self, edge_m: float) -> None:
        self._edge_m = edge_m
        self._empty()

    def _empty(self) -> None:
        self._row: dict[tuple[int, int], int] = {}
        self._xy_m: F64 = np.empty((0, 2))
        self._free_from_m: F64 = np.empty(0)
        self._looks: I64 = np.empty(0, np.int64)

    def remember(self, centres_enu: F64) -> None:
        """(N, 3) voxels that stand in the way now."""
        cells = np.unique(np.floor(centres_enu[:, :2] / self._edge_m).astype(np.int64), axis=0)
        fresh = [cell for cell in map(tuple, cells.tolist()) if cell not in self._row]
        if not fresh:
            return
        self._row |= {cell: len(self._row) + k for k, cell in enumerate(fresh)}
        self._xy_m = np.vstack([self._xy_m, (np.array(fresh, np.float64) + 0.5) * self._edge_m])
        self._free_from_m = np.concatenate([self._free_from_m, np.full(len(fresh), np.inf)])
        self._looks = np.concatenate([self._looks, np.zeros(len(fresh), np.int64)])
        if len(self._row) > MOST_COLUMNS:
            self._drop_oldest()

    def move(self, R_new_old: F64, shift_m: F64) -> None:
        """The map's frame is laid elsewhere, (3, 3) a turn about z and (3,) a shift: the columns go with it."""
        xy_m = self._xy_m @ R_new_old[:2, :2].T + shift_m[:2]
        free_from_m, looks = self._free_from_m + shift_m[2], self._looks
        self._empty()
        self.remember(np.column_stack([xy_m, np.zeros(len(xy_m))]))
        self._looks[:] = np.iinfo(np.int64).max
        self._free_from_m[:] = -np.inf
        # Where two columns have become one, the one of which less is known to be free counts.
        rows = [self._row.get(cell, -1) for cell in map(tuple, np.floor(xy_m / self._edge_m).astype(int).tolist())]
        for row, free_m, looked in zip(rows, free_from_m, looks, strict=True):
            if row >= 0:
                self._free_from_m[row] = max(self._free_from_m[row], free_m)
                self._looks[row] = min(self._looks[row], looked)

    def look(self, pose: Pose, way: Way, sees: Callable[[F64, F64], Bools], occupied: Callable[[F64], Bools]) -> F64:
        """(K,) distances of columns in the way that cannot be seen now, nor have been seen free at this height.

        ``sees(ranges, directions)``: which are in the sensor's field; ``occupied``: which of (M, 3) places are.
        """
        if not self._row:
            return np.empty(0)
        range_m, aside_rad, ahead = self._ahead(pose, way)
        seen = ahead.copy()
        seen[ahead] = sees(range_m[ahead] - self._edge_m * math.sqrt(0.5), aside_rad[ahead])
        self._count(np.flatnonzero(seen), float(pose.position_enu_m[2]), way.height_m, occupied)
        hidden = ahead & ~seen & (self._free_from_m > pose.position_enu_m[2])
        return np.sort(range_m[hidden])

    def _ahead(self, pose: Pose, way: Way) -> tuple[F64, F64, Bools]:
        """(N,) of all columns: range, direction from the nose, and whether they are in the way."""
        away = self._xy_m - pose.position_enu_m[:2]
        sin, cos = math.sin(pose.heading_rad), math.cos(pose.heading_rad)
        along, across = away @ np.array([sin, cos]), away @ np.array([cos, -sin])
        range_m, aside_rad = np.hypot(along, across), np.arctan2(across, along)
        beside = (np.abs(aside_rad) <= way.half_angle_rad) | (np.abs(across) <= way.half_width_m + self._edge_m / 2)
        return range_m, aside_rad, beside & (along > -self._edge_m / 2) & (range_m <= way.depth_m)

    def _count(self, rows: I64, up_m: float, height_m: float, occupied: Callable[[F64], Bools]) -> None:
        """What is looked at now stands there, or is free from here on upwards."""
        if not len(rows):
            return
        levels = np.arange(up_m - height_m / 2, up_m + height_m / 2 + 1e-9, self._edge_m)
        places = np.column_stack([np.repeat(self._xy_m[rows], len(levels), axis=0), np.tile(levels, len(rows))])
        stands = occupied(places).reshape(len(rows), len(levels)).any(axis=1)
        self._looks[rows] = np.where(stands, 0, self._looks[rows] + 1)
        self._free_from_m[rows[stands]] = np.inf
        free = rows[~stands & (self._looks[rows] >= LOOKS)]
        self._free_from_m[free] = np.minimum(self._free_from_m[free], up_m)

    def _drop_oldest(self) -> None:
        kept = list(self._row)[-MOST_COLUMNS // 2 :]
        rows = [self._row[cell] for cell in kept]
        self._xy_m, self._free_from_m, self._looks = self._xy_m[rows], self._free_from_m[rows], self._looks[rows]
        self._row = {cell: k for k, cell in enumerate(kept)}
