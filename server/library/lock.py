"""One Hedgehop per data directory: a lock that the system lets go of however the process ends."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from server.errors import DataDirError


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
        os.truncate(self._handle, 0)
        os.pwrite(self._handle, f"{os.getpid()}\n".encode(), 0)

    def release(self) -> None:
        """The second time nothing happens: the number may belong to another file by then."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
