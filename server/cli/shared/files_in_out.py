"""Files that commands read and write: nothing endless is read, nothing is left half-written."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from planning.errors import FormatError
from planning.formats.safe_text import MAX_BYTES
from server.errors import StorageError, StorageFullError
from server.library.whole_files import TEMPORARY, new_id, write_durably

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


def check_new(recording: Path) -> None:
    """Raises StorageError when there is such a file already, or it cannot be written."""
    check_directory(recording.parent)
    if recording.exists():
        raise StorageError("There is such a file already.", where=str(recording), advice="Give another --record.")


def write_files(directory: Path, files: dict[str, str]) -> None:
    """Writes all files beside their places, then renames them: a full disk leaves the old ones, all of them, whole."""
    with _storage_errors(directory):
        made = [path for path in (directory, *directory.parents) if not path.exists()]
        directory.mkdir(parents=True, exist_ok=True)
        asides = {name: directory / f"{TEMPORARY}{name}-{new_id()}" for name in files}
        try:
            for name, aside in asides.items():
                write_durably(aside, _writer(files[name]))
                aside.chmod(0o644)
            for name, aside in asides.items():
                os.replace(aside, directory / name)
        except BaseException:
            for aside in asides.values():
                aside.unlink(missing_ok=True)
            for folder in made:
                if not any(folder.iterdir()):
                    folder.rmdir()
            raise


def _writer(text: str) -> Callable[[BinaryIO], object]:
    return lambda file: file.write(text.encode())


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
