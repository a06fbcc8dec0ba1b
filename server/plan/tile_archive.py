"""A ZIP archive of GeoTIFF tiles, unpacked for the time in which it is read."""

from __future__ import annotations

import re
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from planning.errors import RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.rasters.tiles import MOST_TILES
from server.library.whole_files import storage_errors

_ENDINGS = (".tif", ".tiff")
_MOST_BYTES = 16 * 2**30
_LEFT_FREE_BYTES = 2**30
"""Of the disk, for the recorder."""


def is_archive(upload: Path) -> bool:
    """Whether an upload is a ZIP archive, by its first bytes."""
    with upload.open("rb") as file:
        return file.read(4) == b"PK\3\4"


@contextmanager
def unpacked_tiles(upload: Path, filename: str) -> Iterator[Path]:
    """A folder with the archive's GeoTIFFs, under names of our own that hold theirs; raises RasterError."""
    with tempfile.TemporaryDirectory(dir=upload.parent, prefix=f"{upload.stem}-") as name:
        folder = Path(name, upload.name)  # errors name it, and whoever reads it knows the upload's name
        folder.mkdir()
        try:
            with storage_errors(upload), zipfile.ZipFile(upload) as archive:
                for number, member in enumerate(_tiles(archive, folder, filename)):
                    # No more is unpacked of a member than its entry says, and that was counted.
                    with archive.open(member) as packed, (folder / _own_name(number, member)).open("xb") as out:
                        shutil.copyfileobj(packed, out, 2**20)
        except RasterError:
            raise  # in its own words, though it is a ValueError too
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
            raise RasterFormatError(
                f"This archive cannot be unpacked ({error}).",
                where=filename,
                advice="Pack the tiles again, without a password, as ZIP with deflate.",
            ) from error
        yield folder


def _tiles(archive: zipfile.ZipFile, folder: Path, filename: str) -> list[zipfile.ZipInfo]:
    """Its GeoTIFFs; RasterError where there is none, or more than the disk takes."""
    found = [member for member in archive.infolist() if _is_tile(member)]
    if not found:
        raise RasterFormatError(
            "There is no GeoTIFF (.tif, .tiff) in this archive.", where=filename, advice="Pack the tiles themselves."
        )
    if len(found) > MOST_TILES:
        raise RasterTooLargeError(
            f"It has more than {MOST_TILES:,} tiles.", where=filename, advice="Pack those around the flight."
        )
    size = sum(member.file_size for member in found)
    room = min(_MOST_BYTES, shutil.disk_usage(folder).free - _LEFT_FREE_BYTES)
    if size > room:
        raise RasterError(
            f"Its tiles take {size / 2**30:.1f} GiB unpacked, and there is room for {max(0, room) / 2**30:.1f} GiB.",
            where=filename,
            advice="Pack those around the flight, or use the command line with the folder.",
        )
    return found


def _is_tile(member: zipfile.ZipInfo) -> bool:
    path = PurePosixPath(member.filename)
    hidden = path.name.startswith(".") or "__MACOSX" in path.parts
    return not member.is_dir() and not hidden and path.suffix.lower() in _ENDINGS


def _own_name(number: int, member: zipfile.ZipInfo) -> str:
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", PurePosixPath(member.filename).stem)[-60:].lstrip(".")
    return f"{number:05d}-{stem}.tif"
