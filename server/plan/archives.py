"""Files that pages bring in, by the operator's names; of ZIP archives limits before anything is read or written."""

from __future__ import annotations

import contextlib
import errno
import io
import shutil
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

from planning.errors import DescribedError, PlanningError
from server.errors import BadRequestError, TooLargeError
from server.library.whole_files import storage_errors
from server.work.jobs import Progress

MOST_DIRECTORY_BYTES = 4 * 2**20
"""Read into memory as a whole before the first file is: with it some ten times as much is taken."""
MOST_MEMBERS = 40_000
LONGEST_NAME_BYTES = 200
LEFT_FREE_BYTES = 2**30
"""Of the disk, for the recorder."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_NAMES = {zipfile.ZIP_BZIP2: "bzip2", zipfile.ZIP_LZMA: "lzma", 9: "deflate64", 93: "zstd"}
_PIECE_BYTES = 2**20
_PASSWORD = 1
_MAGIC = b"PK\3\4"
_BROKEN = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, struct.error, ValueError)


def is_archive(upload: Path) -> bool:
    """Whether an upload is a ZIP archive, by its first bytes."""
    with storage_errors(upload), upload.open("rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC


@contextlib.contextmanager
def named(upload: Path, filename: str, *, kind: type[DescribedError] = PlanningError) -> Iterator[None]:
    """Errors name the operator's file, not the place where its upload lies."""
    try:
        yield
    except kind as error:
        for part in ("what", "where", "advice"):
            text = getattr(error, part).replace(upload.name, filename).replace(upload.stem, filename)
            setattr(error, part, text)
        raise


@contextlib.contextmanager
def opened(upload: Path, filename: str) -> Iterator[zipfile.ZipFile]:
    """Raises TooLargeError before a directory that is too large is read, BadRequestError for what is no archive."""
    with storage_errors(upload), _Bounded(upload) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                if len(archive.filelist) > MOST_MEMBERS:
                    raise _too_many(f"more than {MOST_MEMBERS:,} files")
                yield archive
        except DescribedError as error:  # in its own words, though it may be a ValueError too
            error.where = error.where or filename
            raise
        except _BROKEN as error:
            raise _broken(f"{error}", filename) from None
        except OSError as error:
            if error.errno != errno.EINVAL:
                raise
            raise _broken("it points to nowhere", filename) from None


def unpack(
    archive: zipfile.ZipFile, wanted: Mapping[str, zipfile.ZipInfo], folder: Path, filename: str, *,
    most_bytes: int, report: Progress,
) -> None:  # fmt: skip
    """Each under its name into ``folder``, which is made; what was written when it fails is the caller's to remove.

    Raises BadRequestError for ways of packing other than deflate and for damage, TooLargeError where all of them
    would be more than ``most_bytes`` or than the disk takes, StorageError.
    """
    _check(wanted, folder.parent, filename, most_bytes)
    with storage_errors(folder):
        folder.mkdir(mode=0o700)
    total, done = max(1, sum(member.file_size for member in wanted.values())), 0
    for name, member in wanted.items():
        target, left = folder / name, member.file_size
        with archive.open(member) as source, _written(target) as out:
            # No more is unpacked of a member than its entry says, and that was counted.
            while piece := source.read(_PIECE_BYTES):
                with storage_errors(target):
                    out.write(piece)
                left, done = left - len(piece), done + len(piece)
                report("Unpacking", done / total)
        if left:
            raise zipfile.BadZipFile(f"a file is {left:,} bytes shorter than its directory says")


def name_of(member: zipfile.ZipInfo) -> str:
    """Without its folders."""
    return PurePosixPath(member.filename).name


def remove_upload(upload: Path) -> None:
    """With folders that a killed worker left beside it, whose names begin with its own."""
    upload.unlink(missing_ok=True)
    for folder in upload.parent.glob(f"{upload.stem}-*"):
        shutil.rmtree(folder, ignore_errors=True)


def _check(wanted: Mapping[str, zipfile.ZipInfo], disk: Path, filename: str, most_bytes: int) -> None:
    for name, member in wanted.items():
        if member.flag_bits & _PASSWORD:
            raise _broken("a password is asked for", filename)
        if member.compress_type not in _METHODS:
            method = _NAMES.get(member.compress_type, f"method {member.compress_type}")
            raise _broken(f"its files are packed by {method}", filename)
        if (length := len(name.encode(errors="surrogateescape"))) > LONGEST_NAME_BYTES:
            what = f"A file's name in the archive has {length} bytes; {LONGEST_NAME_BYTES} are the most."
            raise BadRequestError(what, where=filename, advice="Give its files shorter names and pack it again.")
    size, free = sum(member.file_size for member in wanted.values()), shutil.disk_usage(disk).free
    if size > (room := max(0, min(most_bytes, free - LEFT_FREE_BYTES))):
        what = f"Unpacked its files take {size / 1e9:,.1f} GB, and there is room for {room / 1e9:,.1f} GB."
        advice = "Pack less of it, or free some space."
        raise TooLargeError(what, where=filename, advice=advice)


@contextlib.contextmanager
def _written(target: Path) -> Iterator[io.BufferedWriter]:
    """Errors of what is unpacked pass as they are: only those of opening and closing are the disk's."""
    with storage_errors(target):
        out = target.open("xb")
    try:
        yield out
    finally:
        with storage_errors(target):
            out.close()


class _Bounded(io.FileIO):
    """No single read takes more than a directory may have: ``ZipFile`` reads that one as a whole."""

    def read(self, size: int | None = -1, /) -> bytes:
        wanted = MOST_DIRECTORY_BYTES + 1 if size is None or size < 0 else size
        if size is not None and size > MOST_DIRECTORY_BYTES:
            raise _too_many(f"a directory of {size / 1e6:,.1f} MB")
        return super().read(wanted) or b""


def _too_many(what: str) -> TooLargeError:
    return TooLargeError(f"The archive has {what}.", advice="Pack only what is needed.")


def _broken(why: str, filename: str) -> BadRequestError:
    advice = "Pack it again as ZIP with deflate, without a password."
    return BadRequestError(f"The archive cannot be unpacked ({why}).", where=filename, advice=advice)
