"""An orthomosaic's colours on a north-up grid in the surface model's reference system, to drape on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from affine import Affine
from pyproj import CRS

from mapping.geometry.arrays import F64, U8, Bools
from planning.errors import ParameterError, RasterError, RasterFormatError
from planning.terrain.cells.squares import Inverse, source_places
from planning.terrain.rasters.header import RasterHeader
from planning.terrain.rasters.mapping import source_mapping

Bounds = tuple[float, float, float, float]

_EDGE_POINTS = 33


@dataclass(frozen=True, slots=True)
class Orthophoto:
    """Colours over a part of a surface model."""

    rgb: U8
    """(H, W, 3) red, green, blue; row 0 northernmost; read-only."""
    known: Bools
    """(H, W) whether the orthomosaic covers the pixel; read-only."""
    bounds_m: Bounds
    """West, south, east, north of the outer pixel edges, projected metres."""
    crs: CRS
    """Of the bounds: the surface model's."""

    def __post_init__(self) -> None:
        self.rgb.flags.writeable = False
        self.known.flags.writeable = False


@dataclass(frozen=True, slots=True)
class OrthophotoPlan:
    """Which source pixels are read at which size, and the grid they are brought to."""

    window: tuple[int, int, int, int]
    """First column, first row, columns, rows of the source."""
    out_shape: tuple[int, int]
    """Rows and columns the window is shrunk to while reading."""
    to_source: Inverse
    transform: Affine
    shape: tuple[int, int]
    crs: CRS

    def order(self) -> dict[str, Any]:
        """What the decoding process needs to know."""
        return {"window": self.window, "out_shape": self.out_shape}


def plan_orthophoto(
    header: RasterHeader, source_crs: CRS, bounds_m: Bounds, crs: CRS, *, max_px: int, where: str
) -> OrthophotoPlan:
    """The common part of an orthomosaic and the bounds, at most ``max_px`` wide and high."""
    if max_px < 1:
        raise ParameterError(f"The picture must be at least 1 pixel wide, got {max_px}.", where="max_px")
    _check_colours(header, where)
    forward, to_source = source_mapping(header.affine, source_crs, crs)
    footprint = _extent(*forward(*_outline((0, 0, header.width_px, header.height_px))))
    west, south = max(footprint[0], bounds_m[0]), max(footprint[1], bounds_m[1])
    east, north = min(footprint[2], bounds_m[2]), min(footprint[3], bounds_m[3])
    if not (west < east and south < north):
        raise RasterError(
            "The orthomosaic does not overlap the surface model.",
            where=where,
            advice="Choose the orthomosaic of the same area, or check the reference systems.",
        )
    pixel_m = float(np.sqrt((footprint[2] - footprint[0]) * (footprint[3] - footprint[1])))
    pixel_m /= float(np.sqrt(header.width_px * header.height_px))
    side = max(pixel_m, (east - west) / max_px, (north - south) / max_px)
    shape = (max(1, round((north - south) / side)), max(1, round((east - west) / side)))
    transform = Affine((east - west) / shape[1], 0.0, west, 0.0, -(north - south) / shape[0], north)
    window = _window(to_source, (west, south, east, north), header)
    shrink = max(1.0, side / pixel_m)
    out_shape = (max(1, round(window[3] / shrink)), max(1, round(window[2] / shrink)))
    return OrthophotoPlan(window, out_shape, to_source, transform, shape, crs)


def drape(rgba: U8, plan: OrthophotoPlan) -> Orthophoto:
    """The nearest source pixel of every target pixel; ``rgba`` is (rows, columns, 4) with known > 0 last."""
    rgb = np.zeros((*plan.shape, 3), dtype=np.uint8)
    known = np.zeros(plan.shape, dtype=np.bool_)
    first_column, first_row, columns, rows = plan.window
    for tile, column_f, row_f in source_places(plan.to_source, plan.transform, plan.shape):
        row = np.floor((row_f - first_row) * (rgba.shape[0] / rows)).astype(np.intp)
        column = np.floor((column_f - first_column) * (rgba.shape[1] / columns)).astype(np.intp)
        inside = (row >= 0) & (row < rgba.shape[0]) & (column >= 0) & (column < rgba.shape[1])
        pixels = rgba[np.clip(row, 0, rgba.shape[0] - 1), np.clip(column, 0, rgba.shape[1] - 1)]
        known[tile] = inside & (pixels[..., 3] > 0)
        rgb[tile] = np.where(known[tile][..., None], pixels[..., :3], 0)
    west, north = plan.transform.c, plan.transform.f
    south, east = north + plan.shape[0] * plan.transform.e, west + plan.shape[1] * plan.transform.a
    return Orthophoto(rgb, known, (west, south, east, north), plan.crs)


def _check_colours(header: RasterHeader, where: str) -> None:
    bands = len(header.dtypes)
    if set(header.dtypes) != {"uint8"} or bands not in (1, 2, 3, 4) or header.colours[0] == "palette":
        raise RasterFormatError(
            f"Its {bands} bands of {header.dtypes[0]} ({header.colours[0]}) are no 8-bit colours.",
            where=where,
            advice="Export the orthomosaic as 8-bit red, green, blue.",
        )


def _outline(window: tuple[float, float, float, float]) -> tuple[F64, F64]:
    """Points on the border of (first u, first v, size u, size v)."""
    share = np.linspace(0.0, 1.0, _EDGE_POINTS)
    zero, one = np.zeros_like(share), np.ones_like(share)
    u = np.concatenate([share, share, zero, one]) * window[2] + window[0]
    v = np.concatenate([zero, one, share, share]) * window[3] + window[1]
    return u, v


def _extent(x: F64, y: F64) -> Bounds:
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())


def _window(to_source: Inverse, bounds: Bounds, header: RasterHeader) -> tuple[int, int, int, int]:
    west, south, east, north = bounds
    columns, rows = to_source(*_outline((west, south, east - west, north - south)))
    left, top, right, bottom = _extent(columns, rows)
    first_column, first_row = max(0, int(left) - 1), max(0, int(top) - 1)
    stop_column, stop_row = min(header.width_px, int(right) + 2), min(header.height_px, int(bottom) + 2)
    return first_column, first_row, max(1, stop_column - first_column), max(1, stop_row - first_row)
