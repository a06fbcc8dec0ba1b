"""Decides, from the header alone, how a file becomes a surface model in metres."""

from __future__ import annotations

from dataclasses import dataclass

from pyproj import CRS

from planning.errors import RasterTooLargeError
from planning.rasters import georef
from planning.rasters.header import RasterHeader, check_georeference, check_size, check_surface_bands
from planning.rasters.limits import RasterLimits
from planning.rasters.regrid import Regridding, plan_regridding

_MOST_DRIFT_PX = 0.1


@dataclass(frozen=True, slots=True)
class SurfacePlan:
    """Where the cells of a surface model go, and how stored numbers become metres."""

    header: RasterHeader
    reference: georef.Georeference
    crs: CRS
    """Of the model that is made: projected, in metres."""
    regridding: Regridding | None
    """None where cells stay as they are."""
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
    check_size(header, limits, where=where)
    check_surface_bands(header, where=where)
    check_georeference(header, where=where)
    reference = georef.interpret(header, crs=crs, vertical_datum=vertical_datum, where=where)
    lon, lat = georef.center_lon_lat(header, reference.horizontal, where=where)
    reason = georef.why_reproject(reference.horizontal, lon, lat)
    target = georef.local_utm(lon, lat, where=where) if reason else reference.horizontal
    notes = reference.notes
    if reason:
        notes = (*notes, f"The map grid is in {reason}: the model was brought to {target.name}.")
    regridding = None
    if reason or not _is_square(header):
        regridding = _plan_regridding(header, reference.horizontal, target, limits, where)
    scale, offset = _height_law(header, reference, z_scale)
    if z_scale is not None:
        notes = tuple(note for note in notes if "converted" not in note)
    elif (header.scale, header.offset) != (1.0, 0.0):
        notes = (
            *notes,
            f"The file declares heights = stored * {header.scale:g} + {header.offset:g}; this was applied.",
        )
    return SurfacePlan(header, reference, target, regridding, scale, offset, z_scale is not None or scale != 1.0, notes)


def _plan_regridding(
    header: RasterHeader, source_crs: CRS, target_crs: CRS, limits: RasterLimits, where: str
) -> Regridding:
    shape = (header.height_px, header.width_px)
    regridding = plan_regridding(header.affine, shape, source_crs, target_crs)
    if regridding.pixels > limits.max_px:
        raise RasterTooLargeError(
            f"Brought to north-up squares it has {regridding.pixels:,} cells, more than {limits.max_px:,}.",
            where=where,
            advice="Crop it to the area of the flight, or export it north up with square pixels.",
        )
    return regridding


def _height_law(header: RasterHeader, reference: georef.Georeference, z_scale: float | None) -> tuple[float, float]:
    if z_scale is not None:
        return z_scale, 0.0
    metres = reference.metres_per_height_unit
    return header.scale * metres, header.offset * metres


def _is_square(header: RasterHeader) -> bool:
    """Whether cells are square and axis-parallel, up to a drift of a tenth of a cell over the whole raster."""
    t = header.affine
    size = abs(t.e)
    across = max(header.width_px, header.height_px)
    return t.b == 0 == t.d and abs(abs(t.a) - size) * across <= _MOST_DRIFT_PX * size
