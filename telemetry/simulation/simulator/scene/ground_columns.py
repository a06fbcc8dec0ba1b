"""The ground of a world as rays meet it: a surface model's cells as solid columns, or level."""

from __future__ import annotations

import math
from typing import Self

import numpy as np
from affine import Affine
from numba import njit

from mapping.geometry.arrays import F32, F64
from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from telemetry.simulation.simulator.neu_frame import NeuFrame

_BLOCK = 16
_FIT_M = 500.0
_STEP_M = 0.5


class SceneTerrain:
    """Heights are metres above the frame's origin, which stands on the ground; places are east, north of it.

    The surface model's grid is laid into the frame by the affine map that fits around the origin: good to a few
    centimetres within a kilometre. Unknown cells, and everything outside, are as low as the lowest cell.
    """

    def __init__(self, up_m: F32, to_cells: F64, floor_up_m: float) -> None:
        """``up_m`` (rows, columns), NaN unknown; ``to_cells`` (2, 3): (column, row) of (east, north, 1)."""
        self.up = np.ascontiguousarray(up_m, dtype=np.float32)
        self.to_cells = np.ascontiguousarray(to_cells, dtype=np.float64)
        self.floor_up_m = float(floor_up_m)
        self.maxima = _block_maxima(self.up)

    @classmethod
    def level(cls) -> Self:
        """At the height of the origin everywhere."""
        return cls(np.full((1, 1), np.nan, np.float32), np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), 0.0)

    @classmethod
    def from_dsm(cls, dsm: Dsm, frame: NeuFrame) -> Self:
        """Raises ParameterError where the surface model knows no height at the frame's origin."""
        to_cells = _fit(dsm, frame)
        at_origin = dsm.elevation_at(_xy(dsm, frame, [(0.0, 0.0)]))[0]
        if np.isnan(at_origin):
            raise ParameterError(
                f"The surface model knows no height at {frame.lat_deg:.7f}, {frame.lon_deg:.7f}.",
                where="simulated world",
                advice="Give a home inside the surface model.",
            )
        up = (dsm.elevation_m.astype(np.float64) - at_origin).astype(np.float32)
        return cls(up, to_cells, float(np.nanmin(up)))

    def up_m(self, north_m: float, east_m: float) -> float:
        """As ``Ground`` has it: north first."""
        return float(_up_at(self.up, self.to_cells, self.floor_up_m, east_m, north_m))

    def ups_m(self, east_north_m: F64) -> F64:
        """(N, 2) -> (N,)"""
        places = np.ascontiguousarray(east_north_m, dtype=np.float64)
        out = np.empty(len(places))
        _ups_at(self.up, self.to_cells, self.floor_up_m, places, out)
        return out

    def distance_m(self, points_enu: F64) -> F64:
        """(N,) to the nearest of the columns under and one step around each point; heights between columns count."""
        steps = [(x * _STEP_M, y * _STEP_M) for x in (-1, 0, 1) for y in (-1, 0, 1)]
        ups = np.stack([self.ups_m(points_enu[:, :2] + step) for step in steps])
        up = points_enu[:, 2]
        beside = np.maximum(0.0, np.maximum(ups.min(axis=0) - up, up - ups.max(axis=0)))
        return np.minimum(np.abs(up - ups[4]), np.hypot(beside, _STEP_M))


def _xy(dsm: Dsm, frame: NeuFrame, east_north_m: list[tuple[float, float]]) -> F64:
    places = [frame.geodetic_from_neu((north, east, 0.0))[:2] for east, north in east_north_m]
    return dsm.xy_from_lat_lon(np.array(places))


def _fit(dsm: Dsm, frame: NeuFrame) -> F64:
    """(2, 3) (column, row) of (east, north, 1), by central differences around the origin."""
    here, east, west, north, south = _xy(
        dsm, frame, [(0.0, 0.0), (_FIT_M, 0.0), (-_FIT_M, 0.0), (0.0, _FIT_M), (0.0, -_FIT_M)]
    )
    inverse: Affine = ~dsm.transform
    to_px = np.array([[inverse.a, inverse.b], [inverse.d, inverse.e]])
    to_xy = np.column_stack([east - west, north - south]) / (2 * _FIT_M)
    return np.column_stack([to_px @ to_xy, np.array(inverse @ (float(here[0]), float(here[1])))])


def _block_maxima(up_m: F32) -> F32:
    """Highest cell of each block; -inf where nothing is known."""
    rows, columns = (-(-size // _BLOCK) for size in up_m.shape)
    padded = np.full((rows * _BLOCK, columns * _BLOCK), -np.inf, np.float32)
    padded[: up_m.shape[0], : up_m.shape[1]] = np.where(np.isnan(up_m), -np.inf, up_m)
    return padded.reshape(rows, _BLOCK, columns, _BLOCK).max(axis=(1, 3))


@njit(cache=True, nogil=True)
def _up_at(up, to_cells, floor, east, north):
    column = math.floor(to_cells[0, 0] * east + to_cells[0, 1] * north + to_cells[0, 2])
    row = math.floor(to_cells[1, 0] * east + to_cells[1, 1] * north + to_cells[1, 2])
    if 0 <= row < up.shape[0] and 0 <= column < up.shape[1] and not math.isnan(up[row, column]):
        return np.float64(up[row, column])
    return floor


@njit(cache=True, nogil=True)
def _ups_at(up, to_cells, floor, places, out):
    for n in range(len(places)):
        out[n] = _up_at(up, to_cells, floor, places[n, 0], places[n, 1])


@njit(cache=True, nogil=True)
def _leave(start, step, cell):
    """The parameter at which ``start + t * step`` leaves the cell."""
    if step > 0.0:
        return (cell + 1 - start) / step
    return (cell - start) / step if step < 0.0 else math.inf


@njit(cache=True, nogil=True)
def _in_block(up, i0, j0, x, y, z, dx, dy, dz, t, t_end):
    """First t in [t, t_end] at which the ray is in a column of the block; inf if it is in none."""
    i1, j1 = min(up.shape[0], i0 + _BLOCK) - 1, min(up.shape[1], j0 + _BLOCK) - 1
    i = min(max(math.floor(y + t * dy), i0), i1)
    j = min(max(math.floor(x + t * dx), j0), j1)
    while i0 <= i <= i1 and j0 <= j <= j1:
        out_x, out_y = _leave(x, dx, j), _leave(y, dy, i)
        out = min(out_x, out_y, t_end)
        top = up[i, j]
        if z + t * dz <= top:
            return t
        if dz < 0.0 and z + out * dz <= top:
            return (top - z) / dz
        if out >= t_end:
            break
        if out_x <= out_y:
            j += 1 if dx > 0.0 else -1
        else:
            i += 1 if dy > 0.0 else -1
        t = max(t, out)
    return math.inf


@njit(cache=True, nogil=True)
def first_ground(up, maxima, to_cells, floor, ox, oy, oz, dx, dy, dz, t_most):
    """The first t in [0, t_most] at which the ray o + t d is in the ground; inf if it never is.

    Blocks of cells are walked one by one (Amanatides and Woo 1987), and cells only where a block is high enough.
    """
    t_floor = math.inf
    if oz <= floor:
        return 0.0
    if dz < 0.0:
        t_floor = (floor - oz) / dz
    x = to_cells[0, 0] * ox + to_cells[0, 1] * oy + to_cells[0, 2]
    y = to_cells[1, 0] * ox + to_cells[1, 1] * oy + to_cells[1, 2]
    u = to_cells[0, 0] * dx + to_cells[0, 1] * dy
    v = to_cells[1, 0] * dx + to_cells[1, 1] * dy
    t, t_end = 0.0, min(t_most, t_floor)
    for start, step, size in ((x, u, up.shape[1]), (y, v, up.shape[0])):
        if step == 0.0:
            if not 0.0 <= start <= size:
                t_end = -1.0
        else:
            a, b = -start / step, (size - start) / step
            t, t_end = max(t, min(a, b)), min(t_end, max(a, b))
    if t < t_end:
        bx, by, bu, bv = x / _BLOCK, y / _BLOCK, u / _BLOCK, v / _BLOCK
        i = min(max(math.floor(by + t * bv), 0), maxima.shape[0] - 1)
        j = min(max(math.floor(bx + t * bu), 0), maxima.shape[1] - 1)
        while 0 <= i < maxima.shape[0] and 0 <= j < maxima.shape[1]:
            out_x, out_y = _leave(bx, bu, j), _leave(by, bv, i)
            out = min(out_x, out_y, t_end)
            if min(oz + t * dz, oz + out * dz) <= maxima[i, j]:
                hit = _in_block(up, i * _BLOCK, j * _BLOCK, x, y, oz, u, v, dz, t, out)
                if hit < math.inf:
                    return hit
            if out >= t_end:
                break
            if out_x <= out_y:
                j += 1 if u > 0.0 else -1
            else:
                i += 1 if v > 0.0 else -1
            t = max(t, out)
    return t_floor if t_floor <= t_most else math.inf
