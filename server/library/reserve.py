"""Room that is kept for a full disk: given up when the disk is full, so that the station can start and sign people in.

What fills a disk is mostly something else. Then a few megabytes for sessions, the lease, the audit and the logs decide
whether a vehicle can still be led home.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import shutil
from collections.abc import Callable
from pathlib import Path

from server.schemas import ErrorDoc

log = logging.getLogger("hedgehop.disk")

FILE = "reserve"
MOST_BYTES = 32 * 1024**2
SHARE = 50
"""One part of so many of the disk, if that is less; none of a very small one."""
LOOK_EVERY_S = 5.0
_SMALL_BYTES = 32 * 1024**2
_LOW_BYTES = 256 * 1024
_ROOM_AGAIN = 4


class Reserve:
    """Blocking calls, for threads; none of them raises for a disk that takes nothing."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._file = folder, folder / FILE
        self._notice: ErrorDoc | None = None

    @property
    def notice(self) -> ErrorDoc | None:
        """What is to stand on every page; None while there is room."""
        return self._notice

    def look(self) -> None:
        """Gives the reserve up when the disk is full, makes it again when there is room for it many times over."""
        try:
            usage = shutil.disk_usage(self._folder)
            kept = self._file.stat().st_blocks * 512 if self._file.is_file() else 0
        except OSError as error:
            self._notice = _unreadable(error, self._folder)
            return
        wanted = 0 if usage.total < _SMALL_BYTES else min(MOST_BYTES, usage.total // SHARE)
        if usage.free < max(wanted // 4, _LOW_BYTES):
            self._release()
            self._notice = _full(usage.free + kept, self._folder)
        elif kept >= wanted or usage.free > _ROOM_AGAIN * wanted:
            if kept < wanted:
                self._make(wanted)
            self._notice = None
        # Between the two, what was said stands: there is room, but not for long.

    def _release(self) -> None:
        with contextlib.suppress(OSError):
            self._file.unlink()
            log.error("The disk is full: its reserve was given up, for what must be written.")

    def _make(self, size: int) -> None:
        with contextlib.suppress(OSError):
            self._file.unlink(missing_ok=True)
            handle = os.open(self._file, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
            try:
                os.posix_fallocate(handle, 0, size)
            finally:
                os.close(handle)


class DiskWatch:
    """Looks every few seconds, and tells every page what changes."""

    def __init__(self, reserve: Reserve, tell: Callable[[ErrorDoc | None], None]) -> None:
        self._reserve, self._tell = reserve, tell

    async def run(self) -> None:
        """Until cancelled."""
        told = None
        while True:
            await asyncio.to_thread(self._reserve.look)
            if (notice := self._reserve.notice) != told:
                self._tell(notice)
                told = notice
            await asyncio.sleep(LOOK_EVERY_S)


def _full(free: int, folder: Path) -> ErrorDoc:
    return ErrorDoc(
        code="disk_full",
        what=f"The disk is full: {free / 1e6:.0f} MB are left. Nothing new is recorded or saved for sure.",
        where=str(folder),
        advice="Vehicles can still be led. Delete old recordings in Review, or other files, before anything else.",
    )


def _unreadable(error: OSError, folder: Path) -> ErrorDoc:
    return ErrorDoc(
        code="storage",
        what=f"The data directory cannot be looked at: {error.strerror}.",
        where=str(folder),
        advice="Check the disk.",
    )
