"""Where a ray of sight meets the surface model, at full resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F32, F64
from planning.errors import ParameterError
from planning.terrain.dsm import Dsm

_MISS, _FLOOR, _CELL = 0, 1, 2
_INSIDE_CELLS = 1e-3
"""A hit on the wall between two columns is moved this far into the column that was hit."""


@dataclass(frozen=True, slots=True)
class TerrainHit:
    """The first place where a ray touches the model, or the floor that stands for unknown terrain."""

    x_m: float
    y_m: float
    alt_dsm_m: float
    known: bool
    """False over unknown cells and outside the model."""
    distance: float
    """Along the ray, in lengths of its direction."""


def raycast(dsm: Dsm, origin_m: F64, direction: F64, *, floor_alt_dsm_m: float) -> TerrainHit | None:
    """First touch of the ray ``origin_m + t * direction``, t >= 0, with the model; None when it meets nothing.

    Cells are solid columns up to their height, as in the clearance certificate. Unknown cells, and everything
    outside the model, are columns up to ``floor_alt_dsm_m``. Cells are visited one by one along the ray
    (Amanatides and Woo 1987), so the cost grows with the cells crossed, not with the model.
    Origin and direction are (3,) x east, y north, alt_dsm, metres. Raises ParameterError unless both are finite.
    """
    origin, ray = np.asarray(origin_m, dtype=np.float64), np.asarray(direction, dtype=np.float64)
    if not (np.isfinite(origin).all() and np.isfinite(ray).all() and ray.any()):
        raise ParameterError(f"A ray needs a finite origin and direction, got {origin} and {ray}.")
    west_m, _, _, north_m = dsm.bounds_m
    to_cells = np.array([1 / dsm.resolution_m, -1 / dsm.resolution_m, 1.0])
    start, step = (origin - [west_m, north_m, 0.0]) * to_cells, ray * to_cells
    kind, t, row, col = _walk(np.asarray(dsm.elevation_m), start, step, floor_alt_dsm_m)
    if kind == _MISS:
        return None
    column_f, row_f, alt_dsm_m = start + t * step
    if kind == _CELL:
        column_f = min(max(column_f, col + _INSIDE_CELLS), col + 1 - _INSIDE_CELLS)
        row_f = min(max(row_f, row + _INSIDE_CELLS), row + 1 - _INSIDE_CELLS)
    x_m, y_m = west_m + column_f * dsm.resolution_m, north_m - row_f * dsm.resolution_m
    return TerrainHit(float(x_m), float(y_m), float(alt_dsm_m), kind == _CELL, float(t))


@njit(cache=True, nogil=True)
def _slab(start: float, step: float, size: float) -> tuple[float, float]:
    """The parameters between which ``start + t * step`` lies in [0, size]."""
    if step == 0.0:
        return (-math.inf, math.inf) if 0.0 <= start <= size else (math.inf, -math.inf)
    a, b = -start / step, (size - start) / step
    return min(a, b), max(a, b)


@njit(cache=True, nogil=True)
def _border(start: float, step: float, cell: int) -> float:
    """The parameter at which the ray leaves ``cell``; counted from the start, so that errors do not add up."""
    if step == 0.0:
        return math.inf
    return (cell + (1 if step > 0.0 else 0) - start) / step


@njit(cache=True, nogil=True)
def _walk(elevation_m: F32, start: F64, step: F64, floor_m: float) -> tuple[int, float, int, int]:
    """(kind of hit, t, row, column) of a ray in (column, row, height) coordinates."""
    rows, cols = elevation_m.shape
    t_floor = math.inf
    if start[2] <= floor_m:
        t_floor = 0.0
    elif step[2] < 0.0:
        t_floor = (floor_m - start[2]) / step[2]
    in_col, out_col = _slab(start[0], step[0], cols)
    in_row, out_row = _slab(start[1], step[1], rows)
    t, t_end = max(0.0, in_col, in_row), min(out_col, out_row)
    if t < t_end and t <= t_floor:
        col = min(max(math.floor(start[0] + t * step[0]), 0), cols - 1)
        row = min(max(math.floor(start[1] + t * step[1]), 0), rows - 1)
        while 0 <= row < rows and 0 <= col < cols:
            t_col, t_row = _border(start[0], step[0], col), _border(start[1], step[1], row)
            leave = min(t_col, t_row, t_end)
            height_m = elevation_m[row, col]
            if not math.isnan(height_m):
                if start[2] + t * step[2] <= height_m:
                    return _CELL, t, row, col
                if step[2] < 0.0 and start[2] + leave * step[2] <= height_m:
                    return _CELL, (height_m - start[2]) / step[2], row, col
            if leave >= t_floor or leave >= t_end:
                break
            if t_col <= t_row:
                col += 1 if step[0] > 0.0 else -1
            else:
                row += 1 if step[1] > 0.0 else -1
            t = max(t, leave)
    if t_floor < math.inf:
        return _FLOOR, t_floor, -1, -1
    return _MISS, 0.0, -1, -1
