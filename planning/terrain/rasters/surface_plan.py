"""Decides, from the header alone, how a file becomes a surface model in metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.errors import RasterTooLargeError
from planning.terrain.cells.cells import Placing, place_cells
from planning.terrain.cells.squares import square_grid
from planning.terrain.rasters import georef
from planning.terrain.rasters.header import (
    RasterHeader,
    RasterLimits,
    check_georeference,
    check_size,
    check_surface_bands,
)
from planning.terrain.rasters.mapping import extent_of, source_mapping

_MOST_DRIFT_PX = 0.1
"""Oblong cells that are nowhere farther from squares than this stay in their places in the grid of squares."""
_SAME_M = 1e-4
"""Cells nowhere farther from squares than this are squares."""


@dataclass(frozen=True, slots=True)
class SurfacePlan:
    """Where the cells of a surface model go, and how stored numbers become metres."""

    header: RasterHeader
    reference: georef.Georeference
    crs: CRS
    """Of the model that is made: projected, in metres."""
    affine: Affine
    """Of the file's pixels, in ``crs``'s metres where only the unit changed; of the file otherwise."""
    placing: Placing | None
    """Where the file's cells lie; None: they are squares of the model themselves."""
    grid: tuple[Affine, tuple[int, int]] | None
    """Transform and (rows, columns) of the squares that stand for them; None: one for each pixel."""
    height_scale: float
    height_offset: float
    """metres = stored * scale + offset"""
    scaled: bool
    """Whether file or user said in which unit the stored numbers are, other than metres."""
    notes: tuple[str, ...]


def plan_surface(
    header: RasterHeader,
    *,
    crs: str | None,
    z_scale: float | None,
    vertical_datum: str | None,
    limits: RasterLimits,
    where: str,
) -> SurfacePlan:
    """Judge a header and plan what to do with the file; raises the RasterError that refuses it."""
    check_size(header, limits.max_file_px, limits, where=where)
    check_surface_bands(header, where=where)
    check_georeference(header, where=where)
    reference = georef.interpret(header, crs=crs, vertical_datum=vertical_datum, where=where)
    lon, lat = georef.center_lon_lat(header, reference.horizontal, where=where)
    reason = georef.why_reproject(reference.horizontal, lon, lat)
    target, affine, notes = reference.horizontal, header.affine, reference.notes
    if reason:
        target = georef.local_utm(lon, lat, where=where)
        notes = (*notes, f"The map grid is in {reason}: the model was brought to {target.name}.")
    elif (unit := georef.unit_m(reference.horizontal)) != 1.0:
        target, affine = georef.in_metres(reference.horizontal), Affine.scale(unit) @ header.affine
        name = reference.horizontal.axis_info[0].unit_name
        notes = (*notes, f"The map grid is in units of {name}: its cells were kept, measured in metres.")
    placing, grid = _placed(header, affine, None if reason is None else (reference.horizontal, target), limits, where)
    scale, offset = _height_law(header, reference, z_scale)
    if z_scale is not None:
        notes = tuple(note for note in notes if "converted" not in note)
    elif (header.scale, header.offset) != (1.0, 0.0):
        notes = (
            *notes,
            f"The file declares heights = stored * {header.scale:g} + {header.offset:g}; this was applied.",
        )
    scaled = z_scale is not None or scale != 1.0
    return SurfacePlan(header, reference, target, affine, placing, grid, scale, offset, scaled, notes)


def _placed(
    header: RasterHeader, affine: Affine, systems: tuple[CRS, CRS] | None, limits: RasterLimits, where: str
) -> tuple[Placing | None, tuple[Affine, tuple[int, int]] | None]:
    """Where the file's cells lie and which squares stand for them, where they are no such squares themselves."""
    drift_px = np.inf if systems else _drift_px(header, affine)
    if drift_px * abs(affine.e) <= _SAME_M:
        return None, None
    shape = (header.height_px, header.width_px)
    forward, _ = source_mapping(affine, *(systems or (None, None)))
    placing = place_cells(shape, forward)
    if drift_px <= _MOST_DRIFT_PX:
        return placing, None
    grid = square_grid(placing.layout, extent_of(forward, shape))
    pixels = grid[1][0] * grid[1][1]
    if pixels > limits.max_file_px:
        raise RasterTooLargeError(
            f"Brought to north-up squares it has {pixels:,} cells, more than {limits.max_file_px:,}.",
            where=where,
            advice="Crop it to the area of the flight, or export it north up with square pixels.",
        )
    return placing, grid


def _height_law(header: RasterHeader, reference: georef.Georeference, z_scale: float | None) -> tuple[float, float]:
    if z_scale is not None:
        return z_scale, 0.0
    metres = reference.metres_per_height_unit
    return header.scale * metres, header.offset * metres


def _drift_px(header: RasterHeader, affine: Affine) -> float:
    """How far cells lie from squares at the end of the raster; infinite where they are turned."""
    if not (affine.b == 0 == affine.d):
        return np.inf
    across = max(header.width_px, header.height_px)
    return abs(abs(affine.a) - abs(affine.e)) * across / abs(affine.e)
