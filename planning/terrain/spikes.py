"""Isolated spikes and pits: a few cells far above or below all that surrounds them.

They may be errors of the survey or real masts, so they are reported, and removed only on request.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numba import njit, prange
from scipy import ndimage

from mapping.geometry.arrays import F32
from planning.errors import ParameterError
from planning.terrain.dsm import Dsm

_RELIEF_FACTOR = 2.0
"""A spike stands at least this many times the relief around it above all of it."""
_CELLS_PER_SIZE = 4
"""Finer models are searched at this many cells per largest size."""
_BAND_ROWS = 2048


@dataclass(frozen=True, slots=True)
class Spike:
    """One isolated spike or pit."""

    kind: Literal["spike", "pit"]
    lat_deg: float
    lon_deg: float
    size_m: float
    """Longer side of its bounding box."""
    height_m: float
    """Above the highest (a pit: below the lowest) cell around it; positive."""
    alt_dsm_m: float
    """Of its tip."""
    rim_alt_dsm_m: float
    """Of the highest (a pit: the lowest) cell around it."""
    window: tuple[int, int, int, int]
    """Its cells among the model's ``cells``: first row, first column, rows, columns."""


def find_spikes(
    dsm: Dsm,
    *,
    max_size_m: float | None = None,
    min_height_m: float = 5.0,
    progress: Callable[[float], None] | None = None,
) -> tuple[Spike, ...]:
    """Spikes, then pits, at most ``max_size_m`` wide (by default 1 m or two cells, if that is more).

    A spike is what a morphological opening takes away, small in both directions, surrounded by
    known cells, and above the highest of them by ``min_height_m`` and by twice their relief.
    """
    heights, cell_m = dsm.cells.elevation_m, _cell_m(dsm)
    size_m = max(1.0, 2.0 * cell_m) if max_size_m is None else max_size_m
    if not (size_m > 0 and min_height_m > 0):
        raise ParameterError(f"Size and height of spikes must be greater than 0, got {size_m} and {min_height_m}.")
    pool_px = max(1, int(size_m / cell_m) // _CELLS_PER_SIZE)
    highest, lowest = (heights,) * 2 if pool_px == 1 else _pool(heights, pool_px)
    # A spike as large as allowed may straddle one more pooled cell.
    size_px = math.ceil(size_m / (pool_px * cell_m) - 1e-6) + (pool_px > 1)
    found: list[Spike] = []
    searches: tuple[tuple[Literal["spike", "pit"], F32, float], ...] = (("spike", highest, 1.0), ("pit", lowest, -1.0))
    for step, (kind, grid, sign) in enumerate(searches):
        for window, rim in _search(np.asarray(sign * grid, dtype=np.float32), size_px, min_height_m):
            found.append(_spike(dsm, kind, window, sign * rim, pool_px))
        if progress:
            progress((step + 1) / 2)
    return tuple(found)


def remove_spikes(dsm: Dsm, spikes: tuple[Spike, ...]) -> Dsm:
    """Spikes cut down to the highest cell around them, pits filled to the lowest."""
    if not spikes:
        return dsm
    cells = dsm.cells
    elevation = cells.elevation_m.copy()
    for spike in spikes:
        row, column, rows, columns = spike.window
        part = elevation[row : row + rows, column : column + columns]
        cut = np.minimum if spike.kind == "spike" else np.maximum
        cut(part, np.float32(spike.rim_alt_dsm_m), out=part)
    return dsm.with_cells(elevation)


def _search(grid: F32, size_px: int, min_height_m: float) -> Iterator[tuple[tuple[slice, slice], float]]:
    """Windows of the spikes of a grid, and the highest cell around each; bands of rows bound the memory."""
    halo = 4 * size_px + 8
    for first in range(0, grid.shape[0], _BAND_ROWS):
        start = max(0, first - halo)
        band = grid[start : first + _BAND_ROWS + halo]
        above = _above_opening(band, size_px + 1) > min_height_m
        labels, _ = ndimage.label(above, structure=np.ones((3, 3)))  # pyright: ignore[reportGeneralTypeIssues]
        for rows, columns in ndimage.find_objects(labels):
            here = start + rows.start
            if not first <= here < first + _BAND_ROWS or max(_extent(rows), _extent(columns)) > size_px:
                continue
            rim = _rim(band, rows, columns, reach=max(3, size_px), min_height_m=min_height_m)
            if rim is not None:
                yield (slice(here, here + _extent(rows)), columns), rim


def _above_opening(grid: F32, width_px: int) -> F32:
    """How far each cell stands above the opening with a square; NaN where unknown."""
    unknown = np.isnan(grid)
    eroded = ndimage.minimum_filter(np.where(unknown, np.float32(np.inf), grid), width_px, mode="constant", cval=np.inf)
    eroded[np.isinf(eroded)] = -np.inf
    # The mirrored square: even widths have no middle cell.
    origin = -1 if width_px % 2 == 0 else 0
    opened = ndimage.maximum_filter(eroded, width_px, mode="constant", cval=-np.inf, origin=origin)
    return np.subtract(grid, opened, dtype=np.float32)


def _rim(grid: F32, rows: slice, columns: slice, *, reach: int, min_height_m: float) -> float | None:
    """The highest cell around a window, if the window's peak stands out of its surroundings."""
    top, left = max(0, rows.start - reach), max(0, columns.start - reach)
    around = grid[top : rows.stop + reach, left : columns.stop + reach].copy()
    inner = around[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    peak, cells = float(np.nanmax(inner)), around.size - inner.size
    inner[:] = np.nan
    known = around[~np.isnan(around)]
    if known.size < cells / 2:
        return None
    rim = float(known.max())
    needed = max(min_height_m, _RELIEF_FACTOR * (rim - float(known.min())))
    return rim if peak - rim >= needed else None


def _cell_m(dsm: Dsm) -> float:
    """The longer side of a cell."""
    lattice = dsm.cells.layout.lattice
    return max(lattice.width_m, lattice.height_m)


def _spike(dsm: Dsm, kind: Literal["spike", "pit"], window: tuple[slice, slice], rim: float, pool_px: int) -> Spike:
    row, column = window[0].start * pool_px, window[1].start * pool_px
    cells = dsm.cells
    part = cells.elevation_m[row : window[0].stop * pool_px, column : window[1].stop * pool_px]
    tip = np.nanargmax(part) if kind == "spike" else np.nanargmin(part)
    tip_row, tip_column = np.unravel_index(tip, part.shape)
    alt = float(part[tip_row, tip_column])
    xy_m = cells.layout.xy_of(row + tip_row + 0.5, column + tip_column + 0.5)
    lat, lon = dsm.lat_lon_from_xy(np.array([xy_m]))[0]
    return Spike(
        kind=kind,
        lat_deg=float(lat),
        lon_deg=float(lon),
        size_m=max(part.shape) * _cell_m(dsm),
        height_m=abs(alt - rim),
        alt_dsm_m=alt,
        rim_alt_dsm_m=rim,
        window=(row, column, *part.shape),
    )


def _extent(part: slice) -> int:
    return part.stop - part.start


@njit(cache=True, nogil=True, parallel=True)
def _pool(elevation: F32, factor: int) -> tuple[F32, F32]:
    """Highest and lowest known cell of each block of ``factor`` x ``factor``; NaN where all are unknown."""
    height, width = elevation.shape
    shape = ((height + factor - 1) // factor, (width + factor - 1) // factor)
    highest = np.full(shape, np.nan, dtype=np.float32)
    lowest = np.full(shape, np.nan, dtype=np.float32)
    for i in prange(shape[0]):
        for row in range(i * factor, min(height, (i + 1) * factor)):
            for column in range(width):
                value, j = elevation[row, column], column // factor
                if not value <= highest[i, j] and not np.isnan(value):
                    highest[i, j] = value
                if not value >= lowest[i, j] and not np.isnan(value):
                    lowest[i, j] = value
    return highest, lowest
