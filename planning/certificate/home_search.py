"""The nearest place where a vehicle could stand instead: free to start from, and level enough for the flight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.arrays import F32, F64, I64, Bools
from planning.certificate.home_ground import FREE_STEP_M, HomeGround, free_step_m, gap_m, home_ground
from planning.terrain.dsm import Dsm, SurfaceModel

SEARCHES_M = ((12.0, 0.1), (50.0, 0.2), (150.0, 0.4))
"""(how far around places are looked for, in blocks of which size): most are found in the smallest circle.

Blocks of cells are judged by their highest and lowest; the place found is judged once more by its own cells.
"""
FARTHEST_M = SEARCHES_M[-1][0]
SPARE_M = 0.25
"""A place that is proposed passes anywhere so far around it: nobody sets a vehicle down to the centimetre."""
_STEP_M = 0.25
"""Between the places that are looked at, where cells are smaller."""
_MOST_CHECKED = 50


@dataclass(frozen=True, slots=True)
class Standing:
    """A place to stand."""

    xy_m: tuple[float, float]
    """Projected; the middle of a cell."""
    away_m: float
    drop_m: float
    """By how much a vehicle there may stand lower than the place's own cell."""


_MORE_CELLS = 2
"""Around what is looked at, so that the model's own edge, not a part's, is met."""


def ground_around(model: SurfaceModel, xy_m: tuple[float, float], reach_m: float) -> Dsm:
    """The part of a model, which may still be in its file, that holds all within ``reach_m`` of a projected place."""
    return model.around(np.array([xy_m]), reach_m + _MORE_CELLS * model.resolution_m)


def nearest_standing(
    model: SurfaceModel, xy_m: tuple[float, float], *, centre_m: float, radius_m: float, most_drop_m: float
) -> tuple[Standing | None, Standing | None]:
    """(the nearest place that drops by ``most_drop_m`` at most, the most level one that was found); None without one.

    Both are free of obstacles as `home_ground` judges them. Of places equally far, or equally level, the northernmost
    and westernmost counts.
    """
    level: Standing | None = None
    for search_m, block_m in SEARCHES_M:
        dsm = ground_around(model, xy_m, search_m + 2.0 * (centre_m + SPARE_M + radius_m) + block_m)
        near, found = _search(dsm, xy_m, search_m, block_m, centre_m + SPARE_M, radius_m, most_drop_m)
        if near is not None:
            return near, near
        level = found if level is None or (found is not None and found.drop_m < level.drop_m) else level
    return None, level


@dataclass(frozen=True, slots=True)
class _Grid:
    """Blocks of cells around a place, metres counted east and south of their corner."""

    high_m: F32
    """NaN where any cell of the block is unknown."""
    low_m: F32
    cell_m: float
    west_m: float
    north_m: float
    at_m: F64
    """(2,) the place"""


def _search(
    dsm: Dsm,
    xy_m: tuple[float, float],
    search_m: float,
    block_m: float,
    centre_m: float,
    radius_m: float,
    most_drop_m: float,
) -> tuple[Standing | None, Standing | None]:
    grid = _grid(dsm, xy_m, search_m + centre_m + radius_m, block_m)
    if grid is None:
        return None, None
    places = _places(grid, search_m)
    rough = _rough(grid.high_m, grid.low_m, grid.cell_m, radius_m)
    discs = _discs(grid, rough, centre_m, radius_m)
    drops_m = np.empty(len(places))
    after = 0
    for _ in range(_MOST_CHECKED):
        found = _first(
            grid.high_m, grid.low_m, rough, *discs, grid.cell_m, places, after, centre_m, radius_m, most_drop_m, drops_m
        )
        if found < 0:
            break
        standing = _checked(dsm, grid, places[found], centre_m, radius_m)
        if standing is not None and standing.drop_m <= most_drop_m:
            return standing, standing
        after = found + 1
    for found in np.argsort(drops_m, kind="stable")[:_MOST_CHECKED]:
        standing = _checked(dsm, grid, places[found], centre_m, radius_m) if drops_m[found] < math.inf else None
        if standing is not None:
            return None, standing
    return None, None


def _grid(dsm: Dsm, xy_m: tuple[float, float], half_m: float, block_m: float) -> _Grid | None:
    """The square within ``half_m`` as far as the model goes, in blocks; None where it does not go at all."""
    res = dsm.resolution_m
    block = max(1, int(block_m / res + 1e-9))
    x, y = (xy_m[0] - dsm.transform.c) / res, (dsm.transform.f - xy_m[1]) / res
    row0, row1 = max(0, math.floor(y - half_m / res)), min(dsm.height_px, math.ceil(y + half_m / res))
    col0, col1 = max(0, math.floor(x - half_m / res)), min(dsm.width_px, math.ceil(x + half_m / res))
    row1, col1 = row0 + (row1 - row0) // block * block, col0 + (col1 - col0) // block * block
    if row1 <= row0 or col1 <= col0:
        return None
    cells = dsm.settled(FREE_STEP_M).elevation_m[row0:row1, col0:col1]
    blocks = cells.reshape((row1 - row0) // block, block, (col1 - col0) // block, block)
    return _Grid(
        high_m=np.ascontiguousarray(blocks.max(axis=(1, 3))),
        low_m=np.ascontiguousarray(blocks.min(axis=(1, 3))),
        cell_m=block * res,
        west_m=dsm.transform.c + col0 * res,
        north_m=dsm.transform.f - row0 * res,
        at_m=np.array([(x - col0) * res, (y - row0) * res]),
    )


def _places(grid: _Grid, search_m: float) -> I64:
    """(N, 2) rows and columns of the blocks to look at, the nearest first."""
    stride = max(1, round(_STEP_M / grid.cell_m))
    rows, cols = np.meshgrid(*(np.arange(0, n, stride) for n in grid.high_m.shape), indexing="ij")
    away_m = np.hypot((cols + 0.5) * grid.cell_m - grid.at_m[0], (rows + 0.5) * grid.cell_m - grid.at_m[1])
    order = np.argsort(away_m, axis=None, kind="stable")
    order = order[away_m.ravel()[order] <= search_m]
    return np.column_stack([rows.ravel()[order], cols.ravel()[order]]).astype(np.int64)


def _checked(dsm: Dsm, grid: _Grid, place: I64, centre_m: float, radius_m: float) -> Standing | None:
    """The place judged by the model's own cells."""
    row, col = (np.asarray(place, dtype=np.float64) + 0.5) * grid.cell_m
    xy_m = (grid.west_m + float(col), grid.north_m - float(row))
    ground: HomeGround = home_ground(dsm, xy_m, centre_m=centre_m, radius_m=radius_m)
    if ground.obstacle is not None or not math.isfinite(ground.alt_dsm_m):
        return None
    away_m = float(np.hypot(col - grid.at_m[0], row - grid.at_m[1]))
    return Standing(xy_m, away_m, ground.alt_dsm_m - ground.low_dsm_m)


@njit(cache=True, nogil=True)
def _is_steep(high_m, low_m, r, c, s, d, cell_m):
    return max(high_m[s, d] - low_m[r, c], high_m[r, c] - low_m[s, d]) > free_step_m(s - r, d - c, cell_m, cell_m, 0.0)


@njit(cache=True, nogil=True)
def _rough(high_m, low_m, cell_m, radius_m):
    """Whether a block within ``radius_m`` of each differs from it by more than is free."""
    height, width = high_m.shape
    around = int(radius_m / cell_m) + 1
    rough = np.zeros((height, width), np.bool_)
    for rows in range(around + 1):
        for cols in range(-around, around + 1):
            if (rows == 0 and cols < 0) or gap_m(rows, cols, cell_m, cell_m, 0.0) > radius_m:
                continue
            free_m = free_step_m(rows, cols, cell_m, cell_m, 0.0)
            for r in range(height - rows):
                for c in range(max(0, -cols), min(width, width - cols)):
                    s, d = r + rows, c + cols
                    if high_m[s, d] - low_m[r, c] > free_m or high_m[r, c] - low_m[s, d] > free_m:
                        rough[r, c] = rough[s, d] = True
    return rough


@njit(cache=True, nogil=True)
def _is_blocked_by(high_m, low_m, r, c, cell_m, row, col, reach_m, radius_m):
    """Whether a block in reach of the place (row, col) is too steep beside the block (r, c)."""
    height, width = high_m.shape
    around = int(radius_m / cell_m) + 1
    for s in range(max(0, r - around), min(height, r + around + 1)):
        for d in range(max(0, c - around), min(width, c + around + 1)):
            in_reach = (
                _near_m(s - row, d - col, cell_m) <= reach_m and gap_m(s - r, d - c, cell_m, cell_m, 0.0) <= radius_m
            )
            if in_reach and _is_steep(high_m, low_m, r, c, s, d, cell_m):
                return True
    return False


@njit(cache=True, nogil=True)
def _near_m(rows, cols, cell_m):
    """Distance of the middle of a block to the nearest point of one so many rows and columns away."""
    return cell_m * math.hypot(max(0.0, abs(rows) - 0.5), max(0.0, abs(cols) - 0.5))


def _discs(grid: _Grid, rough: Bools, centre_m: float, radius_m: float) -> tuple[F32, F32, I64, I64, I64]:
    """Lowest blocks and rough ones in windows, and the half widths by row of three discs around a place: what is in
    reach, where a rough block may block, and where it does in any case, for all that is beside it is in reach, too."""
    lowest_m = np.where(np.isnan(grid.low_m), np.float32(-np.inf), grid.low_m)
    reach, may_block, blocks = (
        _half_widths(radius, grid.cell_m) for radius in (centre_m + radius_m, centre_m, centre_m - 1.5 * grid.cell_m)
    )
    widest = int(reach.max())
    return _windows(lowest_m, widest), _windows(np.where(rough, 0.0, 1.0), widest), reach, may_block, blocks


def _half_widths(radius_m: float, cell_m: float) -> I64:
    """(R,) of a disc around a block's middle, from its own row on, in blocks."""
    steps = np.arange(max(0, math.ceil(radius_m / cell_m + 0.5)) + 2)
    near_m = cell_m * np.hypot(*(np.maximum(0.0, side - 0.5) for side in np.meshgrid(steps, steps)))
    counts = (near_m <= radius_m).sum(axis=1)
    return counts[counts > 0].astype(np.int64) - 1


def _windows(value: NDArray[np.floating], half_width: int) -> F32:
    """(L, H, W) the smallest of 1, 2, 4 ... blocks of a row from each one on, as far as it goes."""
    levels = [np.ascontiguousarray(value, dtype=np.float32)]
    while 2 ** len(levels) <= 2 * half_width + 1:
        last, step = levels[-1], 2 ** (len(levels) - 1)
        after = np.full_like(last, np.inf)
        after[:, : max(0, last.shape[1] - step)] = last[:, step:]
        levels.append(np.minimum(last, after))
    return np.stack(levels)


@njit(cache=True, nogil=True)
def _lowest_in(windows, row, col, half_widths):
    """The smallest in a disc around a block."""
    lowest = np.inf
    for rows in range(half_widths.shape[0]):
        wide = 2 * half_widths[rows] + 1
        level = 0
        while 2 << level <= wide:
            level += 1
        first = col - half_widths[rows]
        last = first + wide - (1 << level)
        for r in (row - rows, row + rows):
            lowest = min(lowest, windows[level, r, first], windows[level, r, last])
    return lowest


@njit(cache=True, nogil=True)
def _is_blocked(high_m, low_m, rough, cell_m, row, col, may_block, blocks, reach_m, radius_m):
    """Whether a rough block between both discs is too steep beside one in reach."""
    for rows in range(may_block.shape[0]):
        inner = blocks[rows] if rows < blocks.shape[0] else -1
        for cols in range(inner + 1, may_block[rows] + 1):
            for r in (row - rows, row + rows):
                for c in (col - cols, col + cols):
                    if rough[r, c] and _is_blocked_by(high_m, low_m, r, c, cell_m, row, col, reach_m, radius_m):
                        return True
    return False


@njit(cache=True, nogil=True)
def _drop_m(high_m, low_m, rough, lowest, roughest, reach, may_block, blocks, cell_m, row, col, centre_m, radius_m):
    """By how much a vehicle at a block's middle may stand lower; infinite where it cannot start."""
    around = math.ceil((centre_m + radius_m) / cell_m + 0.5)
    if row < around or col < around or row + around >= high_m.shape[0] or col + around >= high_m.shape[1]:
        return np.inf
    if _lowest_in(roughest, row, col, blocks) == 0.0:
        return np.inf
    low = _lowest_in(lowest, row, col, reach)
    if low == -np.inf:
        return np.inf
    if _lowest_in(roughest, row, col, may_block) == 0.0 and _is_blocked(
        high_m, low_m, rough, cell_m, row, col, may_block, blocks, centre_m + radius_m, radius_m
    ):
        return np.inf
    return high_m[row, col] - low


@njit(cache=True, nogil=True)
def _first(
    high_m, low_m, rough, lowest, roughest, reach, may_block, blocks, cell_m, places, after, centre_m, radius_m,
    most_drop_m, drops_m,
):  # fmt: skip
    """The first place from ``after`` on that drops by no more than asked for, -1 without one; fills ``drops_m``."""
    for k in range(after, places.shape[0]):
        row, col = places[k, 0], places[k, 1]
        drops_m[k] = _drop_m(
            high_m, low_m, rough, lowest, roughest, reach, may_block, blocks, cell_m, row, col, centre_m, radius_m
        )
        if drops_m[k] <= most_drop_m:
            return k
    return -1
