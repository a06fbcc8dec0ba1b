"""Where the cells of a raster lie in another reference system."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from affine import Affine
from pyproj import CRS, Transformer

from mapping.geometry.arrays import F64

Mapping = Callable[[F64, F64], tuple[F64, F64]]

EDGE_POINTS = 33


def source_mapping(source: Affine, source_crs: CRS | None, target_crs: CRS | None) -> tuple[Mapping, Mapping]:
    """(source column, row -> x, y in ``target_crs``) and its inverse; the same system where both are None."""
    inverse = ~source
    if source_crs is None or target_crs is None or source_crs == target_crs:
        return partial(_apply, source), partial(_apply, inverse)
    there = Transformer.from_crs(source_crs, target_crs, always_xy=True)
    back = Transformer.from_crs(target_crs, source_crs, always_xy=True)
    turns = source_crs.is_geographic

    def forward(column: F64, row: F64) -> tuple[F64, F64]:
        return there.transform(*_apply(source, column, row))

    def to_source(x: F64, y: F64) -> tuple[F64, F64]:
        u, v = back.transform(x, y)
        # Longitudes come back in -180..180; a grid across the date line, or one from 0 to 360, counts on.
        return _apply(inverse, u + 360.0 * np.round((source.c - u) / 360.0) if turns else u, v)

    return forward, to_source


def extent_of(forward: Mapping, shape: tuple[int, int]) -> tuple[float, float, float, float]:
    """(west, south, east, north) of a raster of (rows, columns)."""
    share = np.linspace(0.0, 1.0, EDGE_POINTS)
    zero, one = np.zeros_like(share), np.ones_like(share)
    columns = np.concatenate([share, share, zero, one]) * shape[1]
    rows = np.concatenate([zero, one, share, share]) * shape[0]
    x, y = forward(columns, rows)
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())


def _apply(transform: Affine, u: F64, v: F64) -> tuple[F64, F64]:
    return transform.a * u + transform.b * v + transform.c, transform.d * u + transform.e * v + transform.f
