"""Files that commands read and write: nothing endless is read, nothing is left half-written."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from planning.errors import FormatError
from planning.formats.safe_text import MAX_BYTES
from server.errors import StorageError, StorageFullError

_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_ORDER = "The surface model comes first, the points, area or mission second."
_FULL = (errno.ENOSPC, errno.EDQUOT)


def read_small(path: Path) -> bytes:
    """The bytes of a mission, point or polygon file. Raises FormatError for what cannot be one."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        what = f"The file cannot be read: {error.strerror or error}."
        raise FormatError(what, where=str(path), advice="Check the path and its permissions.") from None
    if data.startswith(_TIFF):
        raise FormatError("This is a TIFF.", where=str(path), advice=_ORDER)
    if len(data) > MAX_BYTES:
        what = f"The file has more than {MAX_BYTES // 1024**2} MB, too many for points or a mission."
        raise FormatError(what, where=str(path), advice=_ORDER)
    return data


def check_directory(directory: Path) -> None:
    """Raises StorageError when files cannot be written there; makes nothing yet."""
    nearest = directory.absolute()
    while not nearest.exists() and nearest != nearest.parent:
        nearest = nearest.parent
    if not nearest.is_dir():
        raise StorageError("This is a file, not a directory.", where=str(nearest), advice="Give another --out.")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise StorageError("The directory cannot be written.", where=str(nearest), advice="Give another --out.")


def write_files(directory: Path, files: dict[str, str]) -> None:
    """Writes all files beside their places, then renames them: a full disk leaves the old ones, all of them, whole."""
    with _storage_errors(directory):
        made = _make(directory)
        written: dict[str, str] = {}
        try:
            for name, text in files.items():
                written[name] = _write_beside(directory, name, text)
            for name, temporary in written.items():
                os.replace(temporary, directory / name)
        except BaseException:
            _tidy(written, made)
            raise


def _make(directory: Path) -> list[Path]:
    """Makes the directory and returns those that were made, innermost first."""
    missing = [path for path in (directory, *directory.parents) if not path.exists()]
    directory.mkdir(parents=True, exist_ok=True)
    return missing


def _write_beside(directory: Path, name: str, text: str) -> str:
    handle, temporary = tempfile.mkstemp(dir=directory, prefix=f".{name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return temporary


def _tidy(written: dict[str, str], made: list[Path]) -> None:
    for temporary in written.values():
        Path(temporary).unlink(missing_ok=True)
    for directory in made:
        if not any(directory.iterdir()):
            directory.rmdir()


@contextmanager
def _storage_errors(directory: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        kind = StorageFullError if error.errno in _FULL else StorageError
        raise kind(
            f"The files cannot be written: {error.strerror or error}.",
            where=str(directory),
            advice="Nothing in it was changed. Free some space or give another --out.",
        ) from None
