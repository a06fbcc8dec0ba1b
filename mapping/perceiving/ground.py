"""Known ground: a surface model under the map, and which measurements it explains.

Both papers would alarm on the hillside that a terrain-hugging vehicle flies along. Cells are solid columns, as in the
clearance certificate: what is seen of one is its top and its walls down to its lowest neighbour.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from mapping.geometry.arrays import F32, F64, Bools
from mapping.perceiving.ground_beams import BeamShape, Fan, fan_of_ground

WORKING_CELL_M = 0.25
"""Finer models are taken together to cells of about so much: a look-up then costs the same for all."""


@dataclass(frozen=True, slots=True)
class GroundGrid:
    """A surface model laid under the map frame. Made by ``ground_grid``."""

    up_m: F32
    """(rows, columns) up of each column, map frame; NaN unknown."""
    foot_m: F32
    """(rows, columns) up of the lowest neighbour, or of the lowest part where finer cells were taken together."""
    enu_to_cell: F64
    """(2, 3) [row, column] = enu_to_cell @ [east, north, 1]; k + 0.5 is the centre of cell k."""
    cell_m: float

    def up(self, enu_xy: ArrayLike) -> F64:
        """(N, 2 or 3) east, north -> (N,) up of the column there; NaN outside or unknown."""
        row, col = self._cells(np.asarray(enu_xy, np.float64))
        rows, cols = self.up_m.shape
        inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        out = np.full(len(row), np.nan)
        out[inside] = self.up_m[row[inside].astype(np.intp), col[inside].astype(np.intp)]
        return out

    def explains_points(self, points_enu: NDArray[np.floating], within_m: float = 1.0) -> Bools:
        """(N, 3) -> (N,) whether the surface is within ``within_m``, in space: steep walls count, not just tops."""
        points = np.ascontiguousarray(points_enu, np.float64).reshape(-1, 3)
        return _near_all(self.up_m, self.foot_m, self.enu_to_cell, self.cell_m, points, within_m)

    def explains_rays(
        self, origin_enu: ArrayLike, points_enu: NDArray[np.floating], spread_m: NDArray[np.floating], within_m: float
    ) -> Bools:
        """As ``explains_points``, for points whose distance from ``origin_enu`` may be wrong by ``spread_m`` (N,).

        True where the surface is near any place of the line of sight within that distance of the point.
        """
        points = np.ascontiguousarray(points_enu, np.float64).reshape(-1, 3)
        spread = np.ascontiguousarray(spread_m, np.float64)
        origin = np.ascontiguousarray(origin_enu, np.float64)
        return _near_rays(self.up_m, self.foot_m, self.enu_to_cell, self.cell_m, origin, points, spread, within_m)

    def fan(self, origin_enu: ArrayLike, R_enu_body: F64, *, farthest_m: float, shape: BeamShape | None = None) -> Fan:
        """The surface as a radar at that place and attitude sees it: what it must expect in each of its cells."""
        origin = np.asarray(origin_enu, np.float64)
        return fan_of_ground(
            self.up_m, self.enu_to_cell, self.cell_m, origin, R_enu_body, farthest_m, shape or BeamShape()
        )

    def _cells(self, xy: F64) -> tuple[F64, F64]:
        xy = xy.reshape(-1, xy.shape[-1])
        row, col = self.enu_to_cell[:, :2] @ xy[:, :2].T + self.enu_to_cell[:, 2:]
        return row, col


def ground_grid(up_m: NDArray[np.floating], enu_to_cell: ArrayLike, *, cell_m: float = WORKING_CELL_M) -> GroundGrid:
    """A ``GroundGrid`` from (rows, columns) heights above home, NaN unknown.

    ``enu_to_cell`` (2, 3) maps [east, north, 1] to fractional [row, column] of ``up_m``. Cells finer than ``cell_m``
    are taken together; their highest and lowest part is kept, so nothing that is there is lost.
    Raises ValueError when the map is not invertible or the model is empty.
    """
    affine = np.array(enu_to_cell, np.float64).reshape(2, 3)
    per_m = math.sqrt(abs(float(np.linalg.det(affine[:, :2]))))
    if up_m.ndim != 2 or up_m.size == 0 or not (math.isfinite(per_m) and per_m > 0):
        raise ValueError(f"Known ground needs a grid and an invertible map to it, got {up_m.shape} and {affine}.")
    together = max(1, int(cell_m * per_m * (1 + 1e-6)))
    rows, cols = -(-up_m.shape[0] // together), -(-up_m.shape[1] // together)
    top, low = np.empty((rows, cols), np.float32), np.empty((rows, cols), np.float32)
    _pool(np.asarray(up_m), together, top, low)
    foot = np.empty_like(low)
    _feet(low, foot)
    return GroundGrid(top, foot, affine / together, together / per_m)


@njit(cache=True, nogil=True)
def _pool(up_m, together, top, low):
    for i in range(top.shape[0]):
        for j in range(top.shape[1]):
            high, deep = -np.inf, np.inf
            for r in range(i * together, min(up_m.shape[0], (i + 1) * together)):
                for c in range(j * together, min(up_m.shape[1], (j + 1) * together)):
                    z = up_m[r, c]
                    if np.isfinite(z):
                        high, deep = max(high, z), min(deep, z)
            top[i, j] = high if high > -np.inf else np.nan
            low[i, j] = deep if high > -np.inf else np.nan


@njit(cache=True, nogil=True)
def _feet(low, foot):
    rows, cols = low.shape
    for i in range(rows):
        for j in range(cols):
            deep = low[i, j]
            for r in range(max(0, i - 1), min(rows, i + 2)):
                for c in range(max(0, j - 1), min(cols, j + 2)):
                    if low[r, c] < deep:
                        deep = low[r, c]
            foot[i, j] = deep


@njit(cache=True, nogil=True, inline="always")
def _outside(value, low, high):
    if value < low:
        return low - value
    if value > high:
        return value - high
    return 0.0


@njit(cache=True, nogil=True)
def _near(top, foot, cell_m, row_f, col_f, up, within_m):
    """Whether the shell of any column is within ``within_m`` of one place given in cells."""
    rows, cols = top.shape
    row, col = math.floor(row_f), math.floor(col_f)
    inside = 0 <= row < rows and 0 <= col < cols
    if inside and not math.isnan(top[row, col]) and _outside(up, foot[row, col], top[row, col]) <= within_m:
        return True
    reach = within_m / cell_m
    for r in range(max(0, math.floor(row_f - reach)), min(rows, math.floor(row_f + reach) + 1)):
        away_r = _outside(row_f, r, r + 1) * cell_m
        for c in range(max(0, math.floor(col_f - reach)), min(cols, math.floor(col_f + reach) + 1)):
            away_u = _outside(up, foot[r, c], top[r, c])
            if away_u > within_m or math.isnan(top[r, c]):
                continue
            away_c = _outside(col_f, c, c + 1) * cell_m
            if away_r * away_r + away_c * away_c + away_u * away_u <= within_m * within_m:
                return True
    return False


@njit(cache=True, nogil=True)
def _near_all(top, foot, to_cell, cell_m, points, within_m):
    out = np.zeros(points.shape[0], np.bool_)
    for k in range(points.shape[0]):
        x, y = points[k, 0], points[k, 1]
        row_f = to_cell[0, 0] * x + to_cell[0, 1] * y + to_cell[0, 2]
        col_f = to_cell[1, 0] * x + to_cell[1, 1] * y + to_cell[1, 2]
        out[k] = _near(top, foot, cell_m, row_f, col_f, points[k, 2], within_m)
    return out


@njit(cache=True, nogil=True)
def _near_rays(top, foot, to_cell, cell_m, origin, points, spread, within_m):
    out = np.zeros(points.shape[0], np.bool_)
    for k in range(points.shape[0]):
        dx, dy, dz = points[k, 0] - origin[0], points[k, 1] - origin[1], points[k, 2] - origin[2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        steps = math.ceil(spread[k] / within_m) if length > 0.0 and spread[k] > 0.0 else 0
        for i in range(2 * steps + 1):  # 0, +1, -1, +2, -2 ...: the nearest places first
            j = (i + 1) // 2 if i % 2 == 1 else -(i // 2)
            along = 0.0 if steps == 0 else max(-1.0, j * spread[k] / (steps * length))
            x, y, z = points[k, 0] + along * dx, points[k, 1] + along * dy, points[k, 2] + along * dz
            row_f = to_cell[0, 0] * x + to_cell[0, 1] * y + to_cell[0, 2]
            col_f = to_cell[1, 0] * x + to_cell[1, 1] * y + to_cell[1, 2]
            if _near(top, foot, cell_m, row_f, col_f, z, within_m):
                out[k] = True
                break
    return out
