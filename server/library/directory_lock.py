"""One Hedgehop to a data directory."""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from server.errors import DataDirError


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Raises ``DataDirError`` where it is none, or where another process holds it."""
    if not folder.is_dir():
        raise DataDirError(
            "There is no such data directory.",
            where=str(folder),
            advice="Name the one that the vehicle was set up with.",
        )
    lock = DirectoryLock(folder)
    try:
        yield
    finally:
        lock.release()


class DirectoryLock:
    """Held from construction to ``release``; raises ``DataDirError`` when another process holds it."""

    def __init__(self, folder: Path) -> None:
        self._handle = os.open(folder / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.read(self._handle, 32).decode("ascii", "replace").strip()
            os.close(self._handle)
            raise DataDirError(
                f"Another Hedgehop (process {holder or 'unknown'}) uses this data directory.",
                where=str(folder),
                advice="Stop it, or start this one with another --data-dir.",
            ) from error
        with contextlib.suppress(OSError):  # on a full disk: the number is for people only, the lock holds without
            os.truncate(self._handle, 0)
            os.pwrite(self._handle, f"{os.getpid()}\n".encode(), 0)

    def release(self) -> None:
        """The second time nothing happens: the number may belong to another file by then."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
