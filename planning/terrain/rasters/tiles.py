"""Which files a surface model is read from: itself, the tiles of a folder, or those that a virtual raster names.

Nothing is read because a file says so: what a virtual raster (VRT) names must lie in its folder or below, and of what
it says only these names count. Where a tile lies says the tile.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import ParseError, parse

from planning.errors import RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.rasters.magic import is_virtual

MOST_TILES = 20_000
_MOST_VRT_BYTES = 64 * 2**20
_ENDINGS = (".tif", ".tiff")
_PLAIN_SOURCES = {"SimpleSource", "ComplexSource"}
_HARMLESS = {
    "SourceFilename", "SourceBand", "SourceProperties", "SrcRect", "DstRect", "NODATA", "OpenOptions", "UseMaskBand",
}  # fmt: skip
"""Of a source: what changes no height."""
_REMOTE = ("/vsi", "http:", "https:", "ftp:", "s3:", "gs:")


def tiles_of(source: Path, *, virtual: bool) -> tuple[Path, ...] | None:
    """The tiles of a folder, and of a virtual raster where such are allowed; None for any other file.

    Raises RasterError for a folder without GeoTIFFs and for a virtual raster that is more than a list of tiles.
    """
    if source.is_dir():
        return _in_folder(source)
    return _named_by(source) if virtual and is_virtual(source) else None


def _in_folder(folder: Path) -> tuple[Path, ...]:
    found: list[Path] = []
    for here, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found += [Path(here, name) for name in names if _is_tile(name)]
        _check_count(len(found), folder)
    if not found:
        raise RasterFormatError(
            "There is no GeoTIFF (.tif, .tiff) in this folder.", where=str(folder), advice="Give the folder of tiles."
        )
    return tuple(sorted(found))


def _is_tile(name: str) -> bool:
    return name.lower().endswith(_ENDINGS) and not name.startswith(".")


def _check_count(count: int, source: Path) -> None:
    if count > MOST_TILES:
        raise RasterTooLargeError(
            f"It has more than {MOST_TILES:,} tiles.", where=source.name, advice="Merge some, or give a part of them."
        )


def _named_by(vrt: Path) -> tuple[Path, ...]:
    if vrt.stat().st_size > _MOST_VRT_BYTES:
        raise RasterTooLargeError("This virtual raster is too long to be a list of tiles.", where=vrt.name)
    try:
        root = parse(vrt, forbid_dtd=True).getroot()
        named = [] if root is None else list(_names(root, vrt))
    except (ParseError, DefusedXmlException, OSError) as error:
        raise RasterFormatError(
            f"This virtual raster cannot be read ({error}).", where=vrt.name, advice="Build it again: gdalbuildvrt."
        ) from error
    _check_count(len(named), vrt)
    if not named:
        raise RasterFormatError("This virtual raster names no file.", where=vrt.name, advice="Build it again.")
    return tuple(dict.fromkeys(_below(vrt, name, relative=relative) for name, relative in named))


def _names(root: Element, vrt: Path) -> Iterator[tuple[str, bool]]:
    """Each file named, and whether its name counts from the virtual raster's folder."""
    bands: list[Element] = root.findall("VRTRasterBand")
    if root.tag != "VRTDataset" or root.get("subClass") or len(bands) != 1 or bands[0].get("subClass"):
        raise _more_than_a_list(vrt, "it is warped, derived or has several bands")
    for child in bands[0]:
        if child.tag.endswith("Source"):
            strange = {part.tag for part in child} - _HARMLESS
            if child.tag not in _PLAIN_SOURCES or strange:
                raise _more_than_a_list(vrt, f"it changes heights ({', '.join(sorted(strange)) or child.tag})")
            if child.findtext("SourceBand", "1").strip() != "1":
                raise _more_than_a_list(vrt, "it takes another band than the first")
            named = child.find("SourceFilename")
            if named is None or not (text := (named.text or "").strip()):
                raise _more_than_a_list(vrt, "it has a source without a file")
            yield text, named.get("relativeToVRT") == "1"


def _more_than_a_list(vrt: Path, why: str) -> RasterFormatError:
    return RasterFormatError(
        f"This virtual raster (VRT) is more than a list of tiles: {why}.",
        where=vrt.name,
        advice="Write it out as a GeoTIFF: gdal_translate in.vrt out.tif",
    )


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
