"""What was seen in flight as part of the surface model, and where a line meets it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64
from planning.evading.boxes import half_heights, segment_box_sq
from planning.evading.columns import REACH_UP, standing
from planning.evading.keep_clear import Seen
from planning.terrain.cells.cells import Layout
from planning.terrain.dsm import Dsm

TILE_M = 4.0
"""Side of the squares that tell quickly which voxels lie near a line."""
MOST_TILES = 4_000_000
SAME_PLACE_M = 5.0
"""Along the line: voxels this near to the first one belong to the same conflict."""


class Frame(Protocol):
    """``mapping.geometry.frames.LocalFrame``: east, north, up to latitude, longitude, height."""

    def to_geodetic(self, points_enu: ArrayLike, /) -> F64: ...


@dataclass(frozen=True, slots=True)
class Columns:
    """Voxels as they count for planning: solid from the ground to their tops."""

    xy_m: F64
    """(N, 2) middles, in the surface model's CRS"""
    top_alt_dsm_m: F64
    """(N,) of the voxels themselves, without any safety"""
    edge_m: float


@dataclass(frozen=True, slots=True)
class Conflict:
    """The first place of a line that comes too near to what was seen."""

    ahead_m: float
    """Along the line, to where it is nearest to the first voxel."""
    leg: int
    """Of the line, 0 is the first."""
    distance_m: float
    """Between the line and that voxel; the vehicle's radius is not taken off."""
    enu_m: tuple[float, float, float]
    """That voxel's centre; of a column, its highest voxel's."""
    voxels: int
    """Or columns, that are too near at this place."""
    top_unseen: bool = False
    """It may end below the line: nobody has seen how high it is."""


def columns_from_voxels(
    centres_enu_m: ArrayLike, resolution_m: float, *, frame: Frame, dsm: Dsm, home_alt_dsm_m: float
) -> Columns:
    """Voxels (N, 3) of a map whose up counts from the surface model's height at home."""
    centres = np.asarray(centres_enu_m, np.float64).reshape(-1, 3)
    xy_m = dsm.xy_from_lat_lon(frame.to_geodetic(centres)[:, :2])
    return Columns(xy_m, home_alt_dsm_m + centres[:, 2] + resolution_m / 2, resolution_m)


def burn(dsm: Dsm, columns: Columns) -> Dsm:
    """The model with every cell under a column raised to its top, and half a voxel more on top and at the sides.

    Unknown cells stay unknown: nothing is flown over them anyway. Fill small holes before, not after.
    """
    elevation_m = dsm.cells.elevation_m.copy()
    known = np.isfinite(columns.xy_m).all(axis=1) & np.isfinite(columns.top_alt_dsm_m)
    low_px, high_px = _covered(dsm.cells.layout, columns.xy_m[known], columns.edge_m)
    top_m = columns.top_alt_dsm_m[known] + columns.edge_m / 2
    _raise_cells(elevation_m, low_px, high_px, top_m)
    return dsm.with_cells(elevation_m)


def _covered(layout: Layout, xy_m: F64, reach_m: float) -> tuple[F64, F64]:
    """(N, 2) smallest and largest row and column, in cells, of squares: half of the voxel and its safety around it."""
    corners = [layout.places(xy_m + reach_m * np.array(sign)) for sign in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
    return np.min(corners, axis=0), np.max(corners, axis=0)


@njit(cache=True, nogil=True)
def _raise_cells(elevation_m, low_px, high_px, top_m):
    rows, cols = elevation_m.shape
    for k in range(len(top_m)):
        top = np.float32(top_m[k])
        if top < top_m[k]:
            top = np.nextafter(top, np.float32(np.inf))
        for r in range(max(0, math.floor(low_px[k, 0])), min(rows, math.ceil(high_px[k, 0]))):
            for c in range(max(0, math.floor(low_px[k, 1])), min(cols, math.ceil(high_px[k, 1]))):
                if elevation_m[r, c] < top:
                    elevation_m[r, c] = top


def conflicts(
    line_enu_m: ArrayLike,
    centres_enu_m: ArrayLike,
    *,
    resolution_m: float,
    radius_m: float,
    standing_from_enu_m: ArrayLike | None = None,
    reach_up: float = REACH_UP,
) -> Conflict | None:
    """The first place of a line (K, 3) nearer than ``radius_m`` to a voxel, centres (N, 3). None: there is none.

    ``standing_from_enu_m`` (3,): the vehicle, for voxels of a sensor that does not tell heights (``standing``),
    and the slope that it looks up.
    """
    line = np.ascontiguousarray(line_enu_m, np.float64).reshape(-1, 3)
    centres = np.ascontiguousarray(centres_enu_m, np.float64).reshape(-1, 3)
    if len(line) < 2 or len(centres) == 0:
        return None
    half_m = resolution_m / 2
    near = Seen(_near_tiles(line, centres, half_m + radius_m, any_height=standing_from_enu_m is not None), resolution_m)
    if len(near.centres_enu_m) == 0:
        return None
    if standing_from_enu_m is not None:
        near = standing(near, np.asarray(standing_from_enu_m, np.float64).reshape(3), reach_up=reach_up)
    half_up_m = half_heights(near.half_up_m, half_m, len(near.centres_enu_m))
    along_m, leg, distance_m = _along(line, near.centres_enu_m, half_m, half_up_m, radius_m)
    found = np.flatnonzero(leg >= 0)
    if len(found) == 0:
        return None
    first = found[np.lexsort((distance_m[found], along_m[found]))[0]]
    same = along_m[found] <= along_m[first] + SAME_PLACE_M
    e, n, u = (float(value) for value in near.centres_enu_m[first])
    u += float(half_up_m[first]) - half_m
    is_open = near.is_open is not None and bool(near.is_open[first])
    along, distance = float(along_m[first]), float(distance_m[first])
    return Conflict(along, int(leg[first]), distance, (e, n, u), int(same.sum()), is_open)


def _near_tiles(line: F64, centres: F64, reach_m: float, *, any_height: bool) -> F64:
    """Voxels in squares that the line may come near to."""
    low, high = line.min(axis=0) - reach_m, line.max(axis=0) + reach_m
    tile_m = max(TILE_M, math.sqrt(float(np.prod((high - low)[:2])) / MOST_TILES))
    shape = tuple(int(side) + 1 for side in (high - low)[:2] / tile_m)
    tiles = np.zeros(shape, np.bool_)
    _mark(line, low, tile_m, reach_m, tiles)
    if any_height:
        low[2], high[2] = -np.inf, np.inf
    return _picked(centres, low, high, tile_m, tiles)


@njit(cache=True, nogil=True)
def _mark(line, low, tile_m, reach_m, tiles):
    rows, cols = tiles.shape
    for k in range(line.shape[0] - 1):
        de, dn = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        steps = int(math.sqrt(de * de + dn * dn) / tile_m) + 1
        for s in range(steps):
            e0, n0 = line[k, 0] + de * s / steps, line[k, 1] + dn * s / steps
            e1, n1 = line[k, 0] + de * (s + 1) / steps, line[k, 1] + dn * (s + 1) / steps
            i0 = max(0, math.floor((min(e0, e1) - reach_m - low[0]) / tile_m))
            j0 = max(0, math.floor((min(n0, n1) - reach_m - low[1]) / tile_m))
            i1 = min(rows - 1, math.floor((max(e0, e1) + reach_m - low[0]) / tile_m))
            j1 = min(cols - 1, math.floor((max(n0, n1) + reach_m - low[1]) / tile_m))
            for i in range(i0, i1 + 1):
                for j in range(j0, j1 + 1):
                    tiles[i, j] = True


@njit(cache=True, nogil=True)
def _picked(centres, low, high, tile_m, tiles):
    """Rows of ``centres`` that lie in a marked square and between the heights of ``low`` and ``high``."""
    rows, cols = tiles.shape
    out = np.empty_like(centres)
    count = 0
    for k in range(centres.shape[0]):
        if not low[2] <= centres[k, 2] <= high[2]:
            continue
        e, n = (centres[k, 0] - low[0]) / tile_m, (centres[k, 1] - low[1]) / tile_m
        if 0.0 <= e < rows and 0.0 <= n < cols and tiles[int(e), int(n)]:
            out[count, 0], out[count, 1], out[count, 2] = centres[k, 0], centres[k, 1], centres[k, 2]
            count += 1
    return out[:count]


@njit(cache=True, nogil=True)
def _along(line, centres, half_m, half_up_m, radius_m):
    """Of each voxel: how far along the line is nearest to it on the first leg that is too near; leg -1: none is."""
    count = centres.shape[0]
    along_m, distance_m = np.full(count, np.inf), np.full(count, np.inf)
    leg = np.full(count, -1, np.int64)
    low, high, half = np.empty(3), np.empty(3), np.full(3, half_m)
    for j in range(count):
        passed_m, half[2] = 0.0, half_up_m[j]
        for k in range(3):
            low[k], high[k] = centres[j, k] - half[k], centres[j, k] + half[k]
        for i in range(line.shape[0] - 1):
            a, d = line[i], line[i + 1] - line[i]
            length_m = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
            apart = 0.0
            for k in range(3):
                out = max(low[k] - max(a[k], a[k] + d[k]), min(a[k], a[k] + d[k]) - high[k], 0.0)
                apart += out * out
            if apart < radius_m * radius_m:
                sq, t = segment_box_sq(a, d, low, high)
                if sq < radius_m * radius_m:
                    along_m[j], distance_m[j], leg[j] = passed_m + t * length_m, math.sqrt(sq), i
                    break
            passed_m += length_m
    return along_m, leg, distance_m
