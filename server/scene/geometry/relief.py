"""The safe surface as triangles: as fine as its bends demand near the flight, coarser farther off.

Points are taken from the surface that the plan has computed, so every one of them lies on it; between them the mesh is
straight. A quadtree picks cells' centres by the error that leaving them out would make (after Garland and Heckbert
1995, whose error is measured here block by block), Delaunay joins them without cracks, and samples of the path are
added until the mesh follows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import Delaunay, KDTree

from mapping.geometry.arrays import F64, I64, Bools
from planning.basics.plan_model import SampledPath, Surfaces
from planning.safe_surface.surface import safe_surface_at
from planning.terrain.dsm import Dsm
from server.scene.geometry.payload import Relief

PATH_TOLERANCE_M = 0.03
"""Between mesh and surface at every sample of the path."""
_NEAR_TOLERANCE_M, _TOLERANCE_PER_M = 0.05, 0.01
"""Elsewhere: at the path, and more for each metre from it."""
_POINTS_MAX = 30_000
_CELLS_MAX = 1_000_000
_COARSEST_CELLS = 64
_COARSER = 1.6
_ROUNDS_MAX, _STEPS_MAX = 12, 400
_EDGE = 1e-9
"""Of a triangle's share: a place on an edge is in one of both triangles."""


@dataclass(frozen=True, slots=True)
class _Lattice:
    """Every so manieth cell of the surface, by its centre; the last row and column are the surface's own."""

    row: NDArray[np.intp]
    col: NDArray[np.intp]
    alt_dsm_m: F64
    """(h, w) NaN where unknown"""
    tolerance_m: F64
    """(h, w)"""


def relief(surfaces: Surfaces, path: SampledPath) -> Relief:
    """Of the whole surface that was computed. Nothing but NaN gives a mesh without triangles."""
    lattice = _lattice(surfaces, path)
    xy_m = _centres(surfaces.safe, *_chosen(lattice))
    along = kept_within(path.s_m, path.surface_alt_dsm_m, PATH_TOLERANCE_M / 2)
    points_m = np.vstack([_on_surface(surfaces, xy_m), _samples(path, along)])
    points_m = points_m[np.isfinite(points_m[:, 2])]
    if len(points_m) < 3:
        return Relief(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint32))
    points_m, triangles = _following_path(points_m, path)
    return Relief(points_m, _over_known(surfaces.safe, points_m, triangles).astype(np.uint32))


def _lattice(surfaces: Surfaces, path: SampledPath) -> _Lattice:
    safe = surfaces.safe
    every = max(1, int(np.ceil(np.sqrt(safe.elevation_m.size / _CELLS_MAX))))
    row, col = (np.unique(np.r_[0:count:every, count - 1]) for count in safe.elevation_m.shape)
    alt_m = safe.elevation_m[np.ix_(row, col)].astype(np.float64)
    return _Lattice(row, col, alt_m, _NEAR_TOLERANCE_M + _TOLERANCE_PER_M * _off_path_m(safe, row, col, path))


def _off_path_m(safe: Dsm, row: NDArray[np.intp], col: NDArray[np.intp], path: SampledPath) -> F64:
    """(h, w) distance of each place of the lattice to the path."""
    away = np.ones((len(row), len(col)), dtype=bool)
    row_f, col_f = safe.fractional_cell(path.xy_m)
    at_row, at_col = (np.searchsorted(line, at.astype(np.intp)) for line, at in ((row, row_f), (col, col_f)))
    away[np.minimum(at_row, len(row) - 1), np.minimum(at_col, len(col) - 1)] = False
    spacing_m = safe.resolution_m * (row[-1] + 1) / len(row), safe.resolution_m * (col[-1] + 1) / len(col)
    return np.asarray(ndimage.distance_transform_edt(away, sampling=spacing_m))


def _chosen(lattice: _Lattice) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the surface whose cells become points: as few as the tolerance allows, and affordable."""
    worse = 1.0
    while True:
        chosen = _corners(lattice, worse)
        if np.count_nonzero(chosen) <= _POINTS_MAX:
            row, col = np.nonzero(chosen)
            return lattice.row[row], lattice.col[col]
        worse *= _COARSER


def _corners(lattice: _Lattice, worse: float) -> Bools:
    """(h, w) corners of the largest blocks within which straight lines between corners keep the tolerance."""
    shape = lattice.alt_dsm_m.shape
    chosen, left = np.zeros(shape, dtype=bool), np.ones(shape, dtype=bool)
    chosen[np.ix_(_lines(shape[0], _COARSEST_CELLS), _lines(shape[1], _COARSEST_CELLS))] = True
    side = _COARSEST_CELLS
    while side > 1 and left.any():
        left &= _too_coarse(lattice, side, worse)
        side //= 2
        finer = np.zeros(shape, dtype=bool)
        finer[np.ix_(_lines(shape[0], side), _lines(shape[1], side))] = True
        # A block that is divided gets the corners of its parts, also those on its far edges.
        chosen |= finer & ndimage.maximum_filter(left, size=3)
    return chosen


def _lines(count: int, side: int) -> NDArray[np.intp]:
    return np.unique(np.r_[0:count:side, count - 1])


def _too_coarse(lattice: _Lattice, side: int, worse: float) -> Bools:
    """(h, w) cells of blocks whose inside strays from their corners, or is known only in part."""
    alt_m = lattice.alt_dsm_m
    row, col = _lines(alt_m.shape[0], side), _lines(alt_m.shape[1], side)
    straight_m = _between(_between(alt_m[np.ix_(row, col)], row, alt_m.shape[0]).T, col, alt_m.shape[1]).T
    with np.errstate(invalid="ignore"):
        off = np.abs(alt_m - straight_m) > worse * lattice.tolerance_m
    off |= np.isnan(alt_m) != np.isnan(straight_m)
    block_row, block_col = np.arange(alt_m.shape[0]) // side, np.arange(alt_m.shape[1]) // side
    edges = np.arange(0, alt_m.shape[0], side), np.arange(0, alt_m.shape[1], side)
    blocks = np.logical_or.reduceat(np.logical_or.reduceat(off, edges[0], axis=0), edges[1], axis=1)
    return blocks[np.ix_(block_row, block_col)]


def _between(values: F64, at: NDArray[np.intp], count: int) -> F64:
    """(k, w) at the lines ``at`` -> (count, w), straight in between; NaN beside NaN."""
    if len(at) == 1:
        return np.repeat(values, count, axis=0)
    line = np.arange(count)
    after = np.clip(np.searchsorted(at, line), 1, len(at) - 1)
    share = ((line - at[after - 1]) / (at[after] - at[after - 1]))[:, None]
    low, high = values[after - 1], values[after]
    straight = np.where(share == 0, low, np.where(share == 1, high, low + share * (high - low)))
    return straight


def _centres(safe: Dsm, row: NDArray[np.intp], col: NDArray[np.intp]) -> F64:
    west, _, _, north = safe.bounds_m
    return np.asarray(
        np.column_stack([west + (col + 0.5) * safe.resolution_m, north - (row + 0.5) * safe.resolution_m]),
        dtype=np.float64,
    )


def _on_surface(surfaces: Surfaces, xy_m: F64) -> F64:
    return np.column_stack([xy_m, safe_surface_at(surfaces, xy_m)])


def _samples(path: SampledPath, which: NDArray[np.intp]) -> F64:
    return np.column_stack([path.xy_m[which], path.surface_alt_dsm_m[which]])


def _following_path(points_m: F64, path: SampledPath) -> tuple[F64, NDArray[np.intp]]:
    """Samples of the path are added where the mesh strays from it most, until it does so nowhere."""
    origin_m = points_m[0]
    mesh = Delaunay(points_m[:, :2] - origin_m[:2], incremental=True)
    for last in (*[False] * (_ROUNDS_MAX - 1), True):
        off_m = np.abs(_height_m(mesh, points_m, path.xy_m - origin_m[:2]) - path.surface_alt_dsm_m)
        # Beyond the outermost cells' centres there is no mesh to stray.
        beyond = np.isnan(off_m) | (off_m > PATH_TOLERANCE_M)
        if not beyond.any():
            break
        more = (
            np.flatnonzero(beyond) if last else _worst_of_each_run(np.where(beyond, np.nan_to_num(off_m, nan=1e9), 0))
        )
        added_m = _samples(path, more)
        points_m = np.vstack([points_m, added_m])
        mesh.add_points(added_m[:, :2] - origin_m[:2])
    mesh.close()
    return points_m, mesh.simplices.astype(np.intp)


def _height_m(mesh: Delaunay, points_m: F64, xy: F64) -> F64:
    """(N,) of the mesh at places in its own coordinates; NaN outside.

    Walks from the triangle of the nearest point towards each place: scipy's own search inverts every triangle first.
    """
    at = mesh.vertex_to_simplex[KDTree(mesh.points).query(xy)[1]].astype(np.intp)
    height_m, walking = np.full(len(xy), np.nan), np.arange(len(xy))
    for _ in range(_STEPS_MAX):
        share = _shares(mesh.points[mesh.simplices[at[walking]]], xy[walking])
        arrived = share.min(axis=1) >= -_EDGE
        height_m[walking[arrived]] = (share * points_m[mesh.simplices[at[walking]], 2]).sum(axis=1)[arrived]
        at[walking] = mesh.neighbors[at[walking], np.argmin(share, axis=1)]
        walking = walking[~arrived & (at[walking] >= 0)]
        if not len(walking):
            break
    return height_m


def _shares(corners: F64, xy: F64) -> F64:
    """(N, 3, 2) triangles, (N, 2) places -> (N, 3) barycentric coordinates."""
    a, b, c = (corners[:, corner] - xy for corner in range(3))
    areas = np.column_stack([_cross(b, c), _cross(c, a), _cross(a, b)])
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.nan_to_num(areas / areas.sum(axis=1, keepdims=True), nan=-1.0)


def _cross(a: F64, b: F64) -> F64:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _worst_of_each_run(error: F64) -> NDArray[np.intp]:
    """Index of the largest value of each run of values above zero."""
    above = np.concatenate([[False], error > 0, [False]])
    begins, ends = np.flatnonzero(above[1:] & ~above[:-1]), np.flatnonzero(above[:-1] & ~above[1:])
    return np.array([a + int(np.argmax(error[a:b])) for a, b in zip(begins, ends, strict=True)], dtype=np.intp)


def _over_known(safe: Dsm, points_m: F64, triangles: NDArray[np.intp]) -> NDArray[np.intp]:
    """Counter-clockwise seen from above; without those that would bridge a gap, and those without an area."""
    a, b, c = (points_m[triangles[:, corner], :2] for corner in range(3))
    twice = _cross(b - a, c - a)
    known = twice != 0
    for place in ((a + b + c) / 3, (a + b) / 2, (b + c) / 2, (c + a) / 2):
        known &= np.isfinite(safe.elevation_at(place))
    turned = np.where((twice < 0)[:, None], triangles[:, ::-1], triangles)
    return turned[known]


def kept_within(s: F64, value: F64, tolerance: float, *, must_keep: I64 | None = None) -> NDArray[np.intp]:
    """Indices between which straight lines stay within ``tolerance`` of every value (Douglas and Peucker 1973)."""
    ends = np.unique(np.r_[0, len(s) - 1, [] if must_keep is None else must_keep].astype(np.intp))
    kept = set(ends.tolist())
    stretches = list(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))
    while stretches:
        first, last = stretches.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        length = s[last] - s[first]
        share = (s[inner] - s[first]) / length if length > 0 else np.zeros(last - first - 1)
        off = np.abs(value[first] + share * (value[last] - value[first]) - value[inner])
        worst = first + 1 + int(np.argmax(off))
        if off[worst - first - 1] > tolerance:
            kept.add(worst)
            stretches += [(first, worst), (worst, last)]
    return np.array(sorted(kept), dtype=np.intp)
