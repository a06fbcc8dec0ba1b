"""The file under a recording: unbuffered, whole blocks or nothing, and locked while somebody writes."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Callable
from pathlib import Path

from telemetry.errors import RecordingError, RecordingFullError

Write = Callable[[int, memoryview], int]
_NO_SPACE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


class Sink:
    """Appends blocks. What ``append`` has returned from survives the end of this process."""

    def __init__(self, path: Path, *, keep: int | None = None, write: Write = os.write) -> None:
        """Creates the file, or goes on behind the first ``keep`` bytes of one that is there.

        Raises RecordingFullError or RecordingError when it cannot be.
        """
        self.path = path
        self._write = write
        self.size = keep or 0
        new = os.O_CREAT | os.O_EXCL if keep is None else 0
        try:
            self._fd = os.open(path, os.O_WRONLY | os.O_APPEND | new | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise describe(error, path) from error
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.ftruncate(self._fd, self.size)
        except OSError as error:
            self.close()
            raise describe(error, path) from error

    def append(self, block: bytes) -> None:
        """All of the block, or an error and the file as it was before.

        A full disk first takes a part of what it is given and reports the error at the next write only.
        """
        rest = memoryview(block)
        try:
            while rest:
                written = self._write(self._fd, rest)
                if written <= 0:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                rest = rest[written:]
        except OSError as error:
            os.ftruncate(self._fd, self.size)
            raise describe(error, self.path) from error
        self.size += len(block)

    def sync(self) -> None:
        """Onto the disk itself, so that not even a power cut takes it."""
        try:
            os.fsync(self._fd)
        except OSError as error:
            raise describe(error, self.path) from error

    def close(self) -> None:
        """Idempotent."""
        if self._fd >= 0:
            fd, self._fd = self._fd, -1
            os.close(fd)


def describe(error: OSError, path: Path) -> RecordingError:
    """An operating system's error as one for people."""
    if error.errno in _NO_SPACE:
        what = "The disk is full: nothing more can be recorded."
        return RecordingFullError(
            what, where=path.name, advice="Delete old recordings; recording then goes on by itself."
        )
    what = f"The recording cannot be written: {error.strerror or error}."
    return RecordingError(what, where=path.name, advice="Check the recordings folder and its disk.")


def being_written(path: Path) -> bool:
    """Whether a living process has the recording open for writing."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
