"""A virtual raster (VRT) as a list of tiles: nothing else that it says of heights or places is dropped in silence.

Its unknown numbers are applied. Whatever else it says must be what the tiles say themselves, or it is refused:
only elements that are known are let pass.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import ParseError, parse
from pyproj import CRS
from pyproj.exceptions import CRSError

from planning.errors import RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.rasters.header import DATUM_TAG
from planning.terrain.rasters.mosaic import Claim, more_than_a_list

_MOST_BYTES = 64 * 2**20
_REMOTE = ("/vsi", "http:", "https:", "ftp:", "s3:", "gs:")
_OF_DATASET = {"SRS", "GeoTransform", "Metadata", "VRTRasterBand", "OverviewList", "BlockXSize", "BlockYSize"}
_OF_BAND = {
    "NoDataValue", "ColorInterp", "Description", "Metadata", "Histograms", "Overview", "UnitType", "Offset", "Scale",
    "SimpleSource", "ComplexSource",
}  # fmt: skip
_OF_SOURCE = {"SourceFilename", "SourceBand", "SourceProperties", "SrcRect", "DstRect", "NODATA"}
_ATTRIBUTES = {
    "VRTDataset": {"rasterXSize", "rasterYSize"},
    "VRTRasterBand": {"dataType", "band", "blockXSize", "blockYSize"},
    "SimpleSource": {"name", "resampling"},
    "ComplexSource": {"name", "resampling"},
}
_DTYPES = {
    "Byte": "uint8", "Int8": "int8", "UInt16": "uint16", "Int16": "int16", "UInt32": "uint32", "Int32": "int32",
    "UInt64": "uint64", "Int64": "int64", "Float16": "float16", "Float32": "float32", "Float64": "float64",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Listed:
    """What is left of a virtual raster: its tiles and what it says of each, and its reference system as text."""

    tiles: dict[Path, Claim]
    crs: str


def listed_by(vrt: Path) -> Listed:
    """RasterError for one that cannot be read, names what lies outside its folder, or is more than a list of tiles."""
    if vrt.stat().st_size > _MOST_BYTES:
        raise RasterTooLargeError("This virtual raster is too long to be a list of tiles.", where=vrt.name)
    try:
        root = parse(vrt, forbid_dtd=True).getroot()
        named = [] if root is None else list(_sources(root, vrt))
    except (ParseError, DefusedXmlException, OSError) as error:
        raise RasterFormatError(
            f"This virtual raster cannot be read ({error}).", where=vrt.name, advice="Build it again: gdalbuildvrt."
        ) from error
    if root is None or not named:
        raise RasterFormatError("This virtual raster names no file.", where=vrt.name, advice="Build it again.")
    tiles: dict[Path, Claim] = {}
    for name, relative, claim in named:
        if tiles.setdefault(_below(vrt, name, relative=relative), claim) != claim:
            raise more_than_a_list(vrt.name, f"it names {name} twice, in two ways")
    return Listed(tiles, (root.findtext("SRS") or "").strip())


def check_crs(said: str, tiles_wkt: str | None, *, where: str) -> None:
    """RasterFormatError when a virtual raster says another reference system than its tiles; it may leave out theirs."""
    if not said:
        return
    try:
        mine, theirs = CRS.from_user_input(said), CRS.from_wkt(tiles_wkt) if tiles_wkt else None
    except CRSError as error:
        raise more_than_a_list(where, "its reference system is not known") from error
    parts = [] if theirs is None else [theirs, *(theirs.sub_crs_list[:1] if theirs.is_compound else ())]
    if not any(mine.equals(part, ignore_axis_order=True) for part in parts):
        raise more_than_a_list(where, "its reference system is not that of its tiles")


def _sources(root: Element, vrt: Path) -> Iterator[tuple[str, bool, Claim]]:
    """Each file named, whether its name counts from the virtual raster's folder, and what is said of it."""
    bands: list[Element] = root.findall("VRTRasterBand")
    if root.tag != "VRTDataset" or root.get("subClass") or len(bands) != 1 or bands[0].get("subClass"):
        raise more_than_a_list(vrt.name, "it is warped, derived or has several bands")
    _check_known(root, _OF_DATASET, vrt)
    _check_known(bands[0], _OF_BAND, vrt)
    for source in bands[0]:
        if source.tag.endswith("Source"):
            _check_known(source, _OF_SOURCE, vrt)
            if source.findtext("SourceBand", "1").strip() != "1":
                raise more_than_a_list(vrt.name, "it takes another band than the first")
            named = source.find("SourceFilename")
            if named is None or not (text := (named.text or "").strip()):
                raise more_than_a_list(vrt.name, "it has a source without a file")
            yield text, named.get("relativeToVRT") == "1", _claim(root, bands[0], source, vrt)


def _check_known(element: Element, children: set[str], vrt: Path) -> None:
    strange = {child.tag for child in element} - children
    strange |= {f"{element.tag} {name}" for name in set(element.attrib) - _ATTRIBUTES.get(element.tag, set())}
    if strange:
        raise more_than_a_list(vrt.name, f"what it says may change heights ({', '.join(sorted(strange))})")


def _claim(root: Element, band: Element, source: Element, vrt: Path) -> Claim:
    try:
        geo = [float(text) for text in (root.findtext("GeoTransform") or "").split(",")]
        x0, dx, turned_x, y0, turned_y, dy = geo
        unknown = [band.findtext("NoDataValue"), source.findtext("NODATA")]
        return Claim(
            nodata=tuple(sorted({float(text) for text in unknown if text and not math.isnan(float(text))})),
            source_rect=_rect(source.find("SrcRect")),
            target_rect=_rect(source.find("DstRect")),
            size_px=(int(root.get("rasterXSize", "")), int(root.get("rasterYSize", ""))),
            transform=(dx, turned_x, x0, turned_y, dy, y0),
            dtype=_DTYPES.get(band.get("dataType", "Byte"), ""),
            scale=float(band.findtext("Scale") or 1.0),
            offset=float(band.findtext("Offset") or 0.0),
            unit=(band.findtext("UnitType") or "").strip(),
            vertical_datum=_datum(root),
        )
    except ValueError as error:
        raise more_than_a_list(
            vrt.name, f"where its tiles lie, or what it calls unknown, cannot be read ({error})"
        ) from error


def _rect(element: Element | None) -> tuple[float, float, float, float]:
    """First column and row, columns and rows; ValueError without them: GDAL would stretch the tile over the whole."""
    if element is None:
        raise ValueError("SrcRect or DstRect is missing")
    xoff, yoff, xsize, ysize = (float(element.get(name, "")) for name in ("xOff", "yOff", "xSize", "ySize"))
    return xoff, yoff, xsize, ysize


def _datum(root: Element) -> str:
    items = root.findall("Metadata/MDI")
    return next(((item.text or "").strip() for item in items if item.get("key") == DATUM_TAG), "")


def _below(vrt: Path, name: str, *, relative: bool) -> Path:
    folder = vrt.resolve().parent
    if name.lower().startswith(_REMOTE) or "://" in name or "\0" in name:
        raise RasterError(
            f"This virtual raster names {name!r}, which is no file of its folder.",
            where=vrt.name,
            advice="Put the tiles beside it.",
        )
    path = ((folder if relative else Path.cwd()) / name).resolve()
    if not path.is_relative_to(folder):
        raise RasterError(
            f"This virtual raster names {name!r}, which lies outside its folder.",
            where=vrt.name,
            advice="Put the tiles into its folder, and build it anew there.",
        )
    return path
