"""Small holes of unknown cells, filled so that no obstacle can hide in them.

Unknown cells belong to one hole when they touch at a side or a CORNER. That is the cautious choice: a hole
that leaks through a corner into a larger one, or to the edge of the model, is not small and stays unknown.
The rim are the known cells that touch the hole, corners included, and the hole takes their MAXIMUM.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from mapping.geometry.arrays import F32, I32, I64
from planning.terrain import SMALL_HOLE_M2
from planning.terrain.dsm import Dsm


@dataclass(frozen=True, slots=True)
class HoleReport:
    """What was filled."""

    count: int
    area_m2: float


def fill_holes(dsm: Dsm, max_area_m2: float = SMALL_HOLE_M2) -> tuple[Dsm, HoleReport]:
    """Fill holes under ``max_area_m2`` that do not touch the model's edge with the maximum of their rim.

    Returns the same model when there is nothing to fill. Holes are found as runs of unknown cells along
    rows, so memory follows the number of runs, not of cells.
    """
    cells = dsm.cells
    rows = _count_runs(cells.elevation_m)
    first = np.concatenate([[0], np.cumsum(rows)]).astype(np.int64)
    if first[-1] == 0:
        return dsm, HoleReport(0, 0.0)
    begin, end = _find_runs(cells.elevation_m, first)
    parent = _join_runs(first, begin, end)
    max_cells = np.ceil(max_area_m2 / cells.area_m2 - 1e-9) - 1  # strictly under the limit
    area_px = _small_holes(first, begin, end, parent, cells.elevation_m.shape[1], max_cells)
    if not (area_px > 0).any():
        return dsm, HoleReport(0, 0.0)
    rim_m = _rim_maxima(cells.elevation_m, first, begin, end, parent, area_px)
    filled_m = cells.elevation_m.copy()
    _fill(filled_m, first, begin, end, parent, rim_m)
    return dsm.with_cells(filled_m), HoleReport(int((area_px > 0).sum()), float(area_px.sum()) * cells.area_m2)


@njit(cache=True, nogil=True, parallel=True)
def _count_runs(elevation_m: F32) -> I64:
    """(H,) number of runs of unknown cells in each row."""
    height, width = elevation_m.shape
    count = np.zeros(height, np.int64)
    for r in prange(height):
        row = elevation_m[r]
        n = np.int64(row[0] != row[0])
        for c in range(1, width):
            n += (row[c] != row[c]) & (row[c - 1] == row[c - 1])
        count[r] = n
    return count


@njit(cache=True, nogil=True, parallel=True)
def _find_runs(elevation_m: F32, first: I64) -> tuple[I32, I32]:
    """(K,) first and past-the-end columns of each run; row r owns runs first[r] .. first[r + 1]."""
    height, width = elevation_m.shape
    begin, end = np.empty(first[height], np.int32), np.empty(first[height], np.int32)
    for r in prange(height):
        run, before = first[r], False
        for c in range(width):
            unknown = np.isnan(elevation_m[r, c])
            if unknown and not before:
                begin[run] = c
            if before and not unknown:
                end[run] = c
                run += 1
            before = unknown
        if before:
            end[run] = width
    return begin, end


@njit(cache=True, nogil=True)
def _root(parent: I32, run: int) -> int:
    while parent[run] != run:
        parent[run] = parent[parent[run]]
        run = parent[run]
    return run


@njit(cache=True, nogil=True)
def _join_runs(first: I64, begin: I32, end: I32) -> I32:
    """(K,) root run of each run; runs of neighbouring rows that touch, corners included, share one."""
    parent = np.arange(begin.size).astype(np.int32)
    for r in range(1, first.size - 1):
        above, here = first[r - 1], first[r]
        while above < first[r] and here < first[r + 1]:
            if begin[above] <= end[here] and begin[here] <= end[above]:
                a, b = _root(parent, above), _root(parent, here)
                parent[max(a, b)] = min(a, b)
            if end[above] < end[here]:
                above += 1
            else:
                here += 1
    for run in range(begin.size):
        parent[run] = _root(parent, run)
    return parent


@njit(cache=True, nogil=True)
def _small_holes(first: I64, begin: I32, end: I32, parent: I32, width: int, max_cells: float) -> I64:
    """(K,) cells of each hole to fill, at its root run; 0 elsewhere."""
    area_px = np.zeros(begin.size, np.int64)
    open_ended = np.zeros(begin.size, np.bool_)
    last_row = first.size - 2
    for r in range(last_row + 1):
        for run in range(first[r], first[r + 1]):
            area_px[parent[run]] += end[run] - begin[run]
            if r == 0 or r == last_row or begin[run] == 0 or end[run] == width:
                open_ended[parent[run]] = True
    for run in range(begin.size):
        if open_ended[run] or area_px[run] > max_cells:
            area_px[run] = 0
    return area_px


@njit(cache=True, nogil=True)
def _rim_maxima(elevation_m: F32, first: I64, begin: I32, end: I32, parent: I32, area_px: I64) -> F32:
    """(K,) highest rim cell of each hole to fill, at its root run; NaN elsewhere."""
    rim_m = np.full(begin.size, np.nan, np.float32)
    for r in range(1, first.size - 2):
        for run in range(first[r], first[r + 1]):
            root = parent[run]
            if area_px[root] == 0:
                continue
            for v in elevation_m[r - 1 : r + 2, begin[run] - 1 : end[run] + 1].flat:
                if v == v and not v <= rim_m[root]:
                    rim_m[root] = v
    return rim_m


@njit(cache=True, nogil=True)
def _fill(elevation_m: F32, first: I64, begin: I32, end: I32, parent: I32, rim_m: F32) -> None:
    for r in range(first.size - 1):
        for run in range(first[r], first[r + 1]):
            if not np.isnan(rim_m[parent[run]]):
                elevation_m[r, begin[run] : end[run]] = rim_m[parent[run]]
