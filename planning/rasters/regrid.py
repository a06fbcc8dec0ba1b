"""Brings cells of any shape to north-up squares without losing a height."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from affine import Affine
from numba import njit, prange
from numpy.typing import NDArray
from pyproj import CRS, Transformer

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Inverse = Callable[[F64, F64], tuple[F64, F64]]
"""Target projected x, y -> source column, row (fractional)."""

_TILE_PX = 1024
_NODE_PX = 32
_PLACES = 9
_EDGE_POINTS = 33


@dataclass(frozen=True, slots=True)
class Regridding:
    """From a source grid to a north-up grid of squares.

    The square's side is the largest for which a target cell, seen in source pixels, is at most one
    pixel wide and high. Every source cell then holds the centre of a target cell, and a target
    cell touches at most two source columns and two rows.
    """

    to_source: Inverse
    transform: Affine
    """Of the target."""
    shape: tuple[int, int]
    half_px: tuple[float, float]
    """Half the width and height of a target cell, in source columns and rows."""

    @property
    def pixels(self) -> int:
        return self.shape[0] * self.shape[1]


def plan_regridding(source: Affine, shape: tuple[int, int], source_crs: CRS, target_crs: CRS) -> Regridding:
    """The grid in ``target_crs`` that covers a source grid of (rows, columns) ``shape``."""
    affine_only = source_crs == target_crs
    forward, to_source = _mappings(source, None if affine_only else (source_crs, target_crs))
    x, y = forward(*_outline(shape))
    west, south, east, north = x.min(), y.min(), x.max(), y.max()
    widest, highest = _reach(to_source, (west, south, east, north), (east - west) / shape[1])
    # A curved mapping is interpolated between nodes, and its reach varies a little from place to place.
    margin = 0.0 if affine_only else 0.01
    side = (1.0 - 2.0 * margin) / max(widest, highest)
    rows = max(1, int(np.ceil((north - south) / side - 1e-6)))
    columns = max(1, int(np.ceil((east - west) / side - 1e-6)))
    half = (0.5 * side * widest + margin - 1e-6, 0.5 * side * highest + margin - 1e-6)
    return Regridding(to_source, Affine(side, 0.0, west, 0.0, -side, north), (rows, columns), half)


def regrid(source: F32, plan: Regridding, *, progress: Callable[[float], None] | None = None) -> F32:
    """The highest source cell that each target cell touches; NaN where its centre is unknown or outside.

    Nowhere lower than the source: (H, W) float32 -> ``plan.shape`` float32.
    """
    target = np.empty(plan.shape, dtype=np.float32)
    for tile, column_f, row_f in source_places(plan.to_source, plan.transform, plan.shape):
        _highest_touched(source, column_f, row_f, *plan.half_px, target[tile])
        if progress:
            progress((tile[0].stop or 0) / plan.shape[0])
    return target


def source_places(
    to_source: Inverse, transform: Affine, shape: tuple[int, int]
) -> Iterator[tuple[tuple[slice, slice], F64, F64]]:
    """Tile by tile, the fractional source (columns, rows) of a target grid's cell centres.

    Exact at nodes every 32 cells and bilinear in between: a map projection bends by less than a
    millimetre over such a span.
    """
    for row in range(0, shape[0], _TILE_PX):
        for column in range(0, shape[1], _TILE_PX):
            rows, columns = min(_TILE_PX, shape[0] - row), min(_TILE_PX, shape[1] - column)
            node_rows, weight_rows = _nodes(rows)
            node_columns, weight_columns = _nodes(columns)
            grid_columns, grid_rows = np.meshgrid(column + node_columns, row + node_rows)
            x, y = _apply(transform, grid_columns, grid_rows)
            places = to_source(x.ravel(), y.ravel())
            column_f, row_f = (weight_rows @ place.reshape(x.shape) @ weight_columns.T for place in places)
            yield (slice(row, row + rows), slice(column, column + columns)), column_f, row_f


def _nodes(count: int) -> tuple[F64, F64]:
    """Positions of nodes on [0, count], and the (count, nodes) weights that interpolate cell centres."""
    intervals = max(1, -(-count // _NODE_PX))
    nodes = np.linspace(0.0, count, intervals + 1)
    place = (np.arange(count) + 0.5) * intervals / count
    left = np.minimum(place.astype(np.intp), intervals - 1)
    weights = np.zeros((count, intervals + 1))
    weights[np.arange(count), left] = 1.0 - (place - left)
    weights[np.arange(count), left + 1] = place - left
    return nodes, weights


def _mappings(source: Affine, systems: tuple[CRS, CRS] | None) -> tuple[Inverse, Inverse]:
    """(source column, row -> target x, y) and its inverse."""
    inverse = ~source
    if systems is None:
        return partial(_apply, source), partial(_apply, inverse)
    there = Transformer.from_crs(systems[0], systems[1], always_xy=True)
    back = Transformer.from_crs(systems[1], systems[0], always_xy=True)

    def forward(column: F64, row: F64) -> tuple[F64, F64]:
        return there.transform(*_apply(source, column, row))

    turns = systems[0].is_geographic

    def to_source(x: F64, y: F64) -> tuple[F64, F64]:
        u, v = back.transform(x, y)
        # Longitudes come back in -180..180; a grid across the date line, or one from 0 to 360, counts on.
        return _apply(inverse, u + 360.0 * np.round((source.c - u) / 360.0) if turns else u, v)

    return forward, to_source


def source_mapping(source: Affine, source_crs: CRS, target_crs: CRS) -> tuple[Inverse, Inverse]:
    """(source column, row -> x, y in ``target_crs``) and its inverse."""
    return _mappings(source, None if source_crs == target_crs else (source_crs, target_crs))


def _apply(transform: Affine, u: F64, v: F64) -> tuple[F64, F64]:
    return transform.a * u + transform.b * v + transform.c, transform.d * u + transform.e * v + transform.f


def _outline(shape: tuple[int, int]) -> tuple[F64, F64]:
    share = np.linspace(0.0, 1.0, _EDGE_POINTS)
    zero, one = np.zeros_like(share), np.ones_like(share)
    columns = np.concatenate([share, share, zero, one]) * shape[1]
    rows = np.concatenate([zero, one, share, share]) * shape[0]
    return columns, rows


def _reach(to_source: Inverse, bounds: tuple[float, float, float, float], step: float) -> tuple[float, float]:
    """Most source columns and rows that a target square of side 1 extends over, anywhere in the bounds."""
    west, south, east, north = bounds
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(west, east, _PLACES), np.linspace(south, north, _PLACES)))
    column, row = to_source(x, y)
    column_x, row_x = to_source(x + step, y)
    column_y, row_y = to_source(x, y + step)
    widest = np.abs(column_x - column) + np.abs(column_y - column)
    highest = np.abs(row_x - row) + np.abs(row_y - row)
    return float(widest.max() / step), float(highest.max() / step)


@njit(cache=True, nogil=True, parallel=True)
def _highest_touched(
    source: F32, column_f: F64, row_f: F64, half_columns: float, half_rows: float, target: F32
) -> None:
    height, width = source.shape
    for i in prange(target.shape[0]):
        for j in range(target.shape[1]):
            row, column = row_f[i, j], column_f[i, j]
            value = np.float32(np.nan)
            if 0 <= row < height and 0 <= column < width and not np.isnan(source[int(row), int(column)]):
                value = source[int(row), int(column)]
                for r in range(max(0, int(np.floor(row - half_rows))), min(height, int(np.floor(row + half_rows)) + 1)):
                    for c in range(
                        max(0, int(np.floor(column - half_columns))),
                        min(width, int(np.floor(column + half_columns)) + 1),
                    ):
                        if source[r, c] > value:
                            value = source[r, c]
            target[i, j] = value
