"""A ZIP archive of GeoTIFF tiles, unpacked for the time in which it is read."""

from __future__ import annotations

import re
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from planning.errors import RasterFormatError, RasterTooLargeError
from planning.terrain.projects import check_surfaces
from planning.terrain.rasters.tiles import MOST_TILES
from server.plan import archives
from server.work.jobs import Progress

_ENDINGS = (".tif", ".tiff")
_MOST_BYTES = 16 * 2**30


@contextmanager
def unpacked_tiles(upload: Path, filename: str, report: Progress) -> Iterator[Path]:
    """A folder with the archive's GeoTIFFs, under names of our own that hold theirs.

    Raises RasterError, BadRequestError, TooLargeError, StorageError. ``archives.remove_upload`` removes what a killed
    worker leaves of it.
    """
    with tempfile.TemporaryDirectory(dir=upload.parent, prefix=f"{upload.stem}-") as name:
        folder = Path(name, upload.name)  # errors name it, and whoever reads it knows the upload's name
        with archives.opened(upload, filename) as archive:
            tiles = {_own_name(number, member): member for number, member in enumerate(_tiles(archive, filename))}
            archives.unpack(archive, tiles, folder, filename, most_bytes=_MOST_BYTES, report=report)
        yield folder


def _tiles(archive: zipfile.ZipFile, filename: str) -> list[zipfile.ZipInfo]:
    """Its GeoTIFFs; RasterError where there is none, or too many."""
    found = [member for member in archive.infolist() if _is_tile(member)]
    if not found:
        raise RasterFormatError(
            "There is no GeoTIFF (.tif, .tiff) in this archive.", where=filename, advice="Pack the tiles themselves."
        )
    if len(found) > MOST_TILES:
        raise RasterTooLargeError(
            f"It has more than {MOST_TILES:,} tiles.", where=filename, advice="Pack those around the flight."
        )
    check_surfaces((member.filename for member in found), where=filename)
    return found


def _is_tile(member: zipfile.ZipInfo) -> bool:
    path = PurePosixPath(member.filename)
    hidden = path.name.startswith(".") or "__MACOSX" in path.parts
    return not member.is_dir() and not hidden and path.suffix.lower() in _ENDINGS


def _own_name(number: int, member: zipfile.ZipInfo) -> str:
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", PurePosixPath(member.filename).stem)[-60:].lstrip(".")
    return f"{number:05d}-{stem}.tif"
