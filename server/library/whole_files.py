"""Files that are either whole or not there, whenever the power goes: write aside, fsync, rename, fsync the folder."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from server.errors import NotFoundError, StorageError, StorageFullError

TEMPORARY = ".tmp-"
_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
_ID_CHARACTERS = frozenset("0123456789abcdefghijklmnopqrstuvwxyz")


def new_id() -> str:
    """A generated name: nothing that a user typed ever becomes a path."""
    return secrets.token_hex(8)


def check_id(name: str, *, kind: str) -> str:
    """The id unchanged; raises ``NotFoundError`` for anything that ``new_id`` could not have made."""
    if not 1 <= len(name) <= 32 or not _ID_CHARACTERS.issuperset(name):
        raise NotFoundError(f"There is no {kind} {name[:40]!r}.", advice="Reload the page for the present list.")
    return name


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turns the system's errors into ours."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise StorageFullError(
                "The disk that holds the data directory is full.",
                where=str(path),
                advice="Free some space and try again: nothing saved before is lost.",
            ) from error
        raise StorageError(
            f"The data directory cannot be used: {error.strerror or error}.",
            where=str(path),
            advice="Check the disk and the folder's permissions.",
        ) from error


def write_atomically(path: Path, data: bytes) -> None:
    """Replaces the file; returns only when the new content would survive a power cut."""
    with storage_errors(path):
        aside = path.with_name(f"{TEMPORARY}{path.name}-{new_id()}")
        try:
            write_durably(aside, lambda file: file.write(data))
            os.replace(aside, path)
            sync_directory(path.parent)
        except BaseException:
            aside.unlink(missing_ok=True)
            raise


def write_durably(path: Path, fill: Callable[[BinaryIO], object]) -> None:
    """A new file, readable by its owner only, on the disk when this returns."""
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600), "wb") as file:
        fill(file)
        file.flush()
        os.fsync(file.fileno())


def sync_directory(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def new_directory(path: Path) -> Iterator[Path]:
    """A folder to fill; it gets its name only when the block ends without an error."""
    with storage_errors(path):
        aside = path.with_name(f"{TEMPORARY}{path.name}")
        aside.mkdir(mode=0o700)
        try:
            yield aside
            sync_directory(aside)
            os.rename(aside, path)
            sync_directory(path.parent)
        except BaseException:
            shutil.rmtree(aside, ignore_errors=True)
            raise


def remove_directory(path: Path) -> None:
    """All of the folder or, after a crash, none of it."""
    with storage_errors(path):
        aside = path.with_name(f"{TEMPORARY}gone-{path.name}-{new_id()}")
        os.rename(path, aside)
        sync_directory(path.parent)
        shutil.rmtree(aside, ignore_errors=True)


def clean(folder: Path) -> None:
    """Removes what a killed server left half-written."""
    for path in folder.glob(f"{TEMPORARY}*"):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
