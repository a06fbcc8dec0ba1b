"""Where a raster lies and what its numbers mean: reference system, datum, unit, and the grid to bring it to."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pyproj import CRS, Proj, Transformer
from pyproj.exceptions import CRSError, ProjError

from planning.errors import MissingCrsError, RasterFormatError
from planning.terrain.dsm import SCALE_TOLERANCE
from planning.terrain.rasters.header import RasterHeader

_FOOT_M, _US_FOOT_M = 0.3048, 1200 / 3937
_UNIT_TAGS_M = {
    "m": 1.0, "metre": 1.0, "meter": 1.0, "metres": 1.0, "meters": 1.0,
    "ft": _FOOT_M, "foot": _FOOT_M, "feet": _FOOT_M,
    "us-ft": _US_FOOT_M, "us survey foot": _US_FOOT_M, "us survey feet": _US_FOOT_M, "us_survey_foot": _US_FOOT_M,
    "foot_us": _US_FOOT_M, "ftus": _US_FOOT_M, "sfoot": _US_FOOT_M, "survey foot": _US_FOOT_M, "yd": 0.9144,
    "km": 1000.0, "dm": 0.1, "decimetre": 0.1, "decimeter": 0.1,
    "cm": 0.01, "centimetre": 0.01, "centimeter": 0.01, "mm": 0.001, "millimetre": 0.001, "millimeter": 0.001,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Georeference:
    """The reference system of a file, as declared or as it says itself, split into its parts."""

    horizontal: CRS
    vertical_datum: str | None
    metres_per_height_unit: float
    notes: tuple[str, ...]
    """What was assumed."""


class SaysWhere(Protocol):
    """What a file's header tells of its place."""

    @property
    def crs_wkt(self) -> str | None: ...
    @property
    def unit(self) -> str | None: ...
    @property
    def vertical_datum(self) -> str | None: ...


def interpret(header: SaysWhere, *, crs: str | None, vertical_datum: str | None, where: str) -> Georeference:
    """What the file says, overridden by what the user declares. MissingCrsError when nobody says anything."""
    source, notes = _source_crs(header, crs, where)
    vertical = _vertical_part(source)
    _refuse_strange_axes(source, vertical, where)
    metres, unit_notes = _height_unit(header, source, vertical)
    in_file = header.vertical_datum or _datum_name(source, vertical)
    if vertical_datum and in_file and vertical_datum != in_file:
        unit_notes = (
            *unit_notes,
            f'The file\'s vertical datum is "{in_file}"; the declared "{vertical_datum}" is used.',
        )
    return Georeference(_horizontal_part(source), vertical_datum or in_file, metres, (*notes, *unit_notes))


def _source_crs(header: SaysWhere, crs: str | None, where: str) -> tuple[CRS, tuple[str, ...]]:
    in_file = CRS.from_wkt(header.crs_wkt) if header.crs_wkt else None
    if crs is None and (in_file is None or in_file.is_engineering):
        raise MissingCrsError(
            "It has no coordinate reference system.",
            where=where,
            advice="Declare the one it was made in, for example --crs EPSG:32633.",
        )
    if crs is None:
        assert in_file is not None
        return in_file, ()
    try:
        declared = CRS.from_user_input(crs)
    except CRSError as error:
        raise MissingCrsError(
            f'"{crs}" is no known coordinate reference system.', where=where, advice="Use a code such as EPSG:32633."
        ) from error
    if in_file is None or in_file == declared:
        return declared, ()
    if declared == _horizontal_part(in_file):
        return in_file, ()
    return declared, (f"The file says {in_file.name}; the declared {declared.name} is used.",)


def _refuse_strange_axes(source: CRS, vertical: CRS | None, where: str) -> None:
    flat = _horizontal_part(source)
    if not (flat.is_geographic or flat.is_projected):
        raise RasterFormatError(
            f"{source.name} is neither a map projection nor latitude and longitude.",
            where=where,
            advice="Reproject it, or declare the right reference system with --crs, for example EPSG:32633.",
        )
    if vertical is not None and any(axis.direction == "down" for axis in vertical.axis_info):
        raise RasterFormatError(
            f"Its numbers are depths that grow downwards ({vertical.name}), not heights.",
            where=where,
            advice="Negate them (gdal_calc.py --calc=-A), or declare the right reference system with --crs.",
        )


def _horizontal_part(crs: CRS) -> CRS:
    return crs.sub_crs_list[0] if crs.is_compound else crs.to_2d()


def _vertical_part(crs: CRS) -> CRS | None:
    return crs.sub_crs_list[1] if crs.is_compound else None


def _datum_name(crs: CRS, vertical: CRS | None) -> str | None:
    if vertical is not None:
        return re.sub(r"\s*\((us-?ft|ft(us|sus)?|m)\)$", "", vertical.name, flags=re.IGNORECASE)
    return "ellipsoid" if len(crs.axis_info) == 3 else None


def _height_unit(header: SaysWhere, crs: CRS, vertical: CRS | None) -> tuple[float, tuple[str, ...]]:
    axes = vertical.axis_info if vertical is not None else crs.axis_info[2:]
    tag = (header.unit or "").strip().lower()
    if axes:
        factor = float(axes[0].unit_conversion_factor)
        said = () if factor == 1.0 else (f"Heights were converted from {axes[0].unit_name} to metres.",)
        return factor, said + _contradiction(tag, factor, axes[0].unit_name)
    if tag in _UNIT_TAGS_M:
        factor = _UNIT_TAGS_M[tag]
        return factor, () if factor == 1.0 else (f'Heights were converted from "{header.unit}" to metres.',)
    horizontal = _horizontal_part(crs)
    factor = 1.0 if horizontal.is_geographic else float(horizontal.axis_info[0].unit_conversion_factor)
    if factor == 1.0:
        return 1.0, _unknown_unit(tag)
    unit = horizontal.axis_info[0].unit_name
    return factor, (
        f"The map grid is in units of {unit} and the file does not say in which unit its heights are: "
        f"they were taken as {unit} too and converted to metres. If they are metres, use --z-scale 1.",
    )


def _contradiction(tag: str, factor: float, unit_name: str) -> tuple[str, ...]:
    if abs(_UNIT_TAGS_M.get(tag, factor) / factor - 1.0) < 1e-5:
        return ()
    return (
        f'The file says "{tag}" of its heights, its reference system {unit_name}: {unit_name} was taken. '
        f"If that is wrong, use --z-scale {_UNIT_TAGS_M[tag]:g}.",
    )


def _unknown_unit(tag: str) -> tuple[str, ...]:
    if tag in ("", "none", "unknown", "1"):
        return ()
    return (
        f'The file gives its heights in "{tag}", no unit known here: they were taken as metres. '
        "If they are not, use --z-scale with the metres of one unit.",
    )


def center_lon_lat(header: RasterHeader, horizontal: CRS, *, where: str) -> tuple[float, float]:
    """WGS84 degrees of the raster's centre; RasterFormatError when the reference system cannot hold it."""
    x, y = header.affine @ (header.width_px / 2, header.height_px / 2)
    try:
        lon, lat = Transformer.from_crs(horizontal, CRS.from_epsg(4326), always_xy=True).transform(x, y)
    except ProjError:
        lon = lat = np.inf
    outside = horizontal.is_geographic and not (abs(x) <= 360 and abs(y) <= 90)
    if outside or not (np.isfinite(lon) and np.isfinite(lat)):
        raise RasterFormatError(
            f"Its centre ({x:.6g}, {y:.6g}) lies outside {horizontal.name}.",
            where=where,
            advice="Declare the right reference system with --crs.",
        )
    return float(lon), float(lat)


def why_reproject(horizontal: CRS, lon: float, lat: float) -> str | None:
    """Why a model in this reference system cannot stay in it; None when its units, in metres, are true."""
    if horizontal.is_geographic:
        return "degrees"
    factors = Proj(horizontal).get_factors(lon, lat)
    scale = max(abs(factors.meridional_scale - 1.0), abs(factors.parallel_scale - 1.0))
    return f"metres that are {scale:.1%} off on the ground" if scale > SCALE_TOLERANCE else None


def metres_in(unit: str) -> float | None:
    """Of a unit by its name, e.g. "ftUS"; None for one that is not known."""
    return _UNIT_TAGS_M.get(unit.strip().lower())


def unit_m(horizontal: CRS) -> float:
    """Metres in the unit of a map projection's axes."""
    return float(horizontal.axis_info[0].unit_conversion_factor)


def in_metres(horizontal: CRS) -> CRS:
    """The same map projection with its axes in metres."""
    fields = horizontal.to_json_dict()
    fields.pop("id", None)
    for axis in fields["coordinate_system"]["axis"]:
        axis["unit"] = "metre"
    fields["name"] = f"{fields['name']} in metres"
    made = CRS.from_json_dict(fields)
    code = made.to_epsg()
    return CRS.from_epsg(code) if code else made


def local_utm(lon: float, lat: float, *, where: str) -> CRS:
    """The UTM zone (WGS84) of a place."""
    if not -80 <= lat <= 84:
        raise RasterFormatError(
            f"It lies at latitude {lat:.2f}, where there is no UTM zone.",
            where=where,
            advice="Reproject it to a polar grid in metres first.",
        )
    zone = int((lon + 180) % 360 // 6) + 1
    return CRS.from_epsg((32600 if lat >= 0 else 32700) + zone)
