"""This station's recordings for those that ask: named by their SHA-256, given in pieces within a budget.

Nothing is read before another station has asked for the list. Then each file is hashed once, newest first, until it
changes; a piece is read from a file that is still the one that was hashed, or not at all.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import os
import stat
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

from telemetry.stations.recordings.asked_and_given import (
    CHANGED,
    LOOKING,
    MOST_OFFERED,
    MOST_RECORDING_BYTES,
    OFF,
    OFFERS_AT_ONCE,
    PIECE_BYTES,
    PIECES_AT_ONCE,
    REMOVED,
    Asked,
    Given,
    ListAsk,
    ListGive,
    NoPiece,
    Offer,
    PieceGive,
    offer,
)
from telemetry.stations.recordings.pieces import Bucket
from telemetry.stations.station_names import MOST_STATIONS
from telemetry.topics.station_recordings import OfferedRecording, OwnRecordings

_log = logging.getLogger(__name__)

READ_BYTES = 4 * 1024**2
"""In one go of a thread: whoever ends waits no longer than for that."""
_WAITING = 4 * PIECES_AT_ONCE
"""Answers that one station may wait for; what it asks for beyond that it asks for again."""
_LIST_BYTES = 2000
_TURN_PIECES = 64
"""At most, in one turn, however large the budget is."""
Look = tuple[int, int, int]
"""What changes with a file: its number, its size, its time."""


@dataclass(frozen=True, slots=True)
class _Read:
    path: Path
    look: Look
    offer: Offer


class Offering:
    """Belongs to one event loop; files are read in threads."""

    def __init__(self) -> None:
        self._own = OwnRecordings(0.0, is_on=False, bytes_per_s=0)
        self._read: dict[str, _Read] = {}
        self._paths: set[str] = set()
        """Of all that are its own, the listed ones among them."""
        self._unreadable: dict[str, Look] = {}
        self._wanted = asyncio.Event()
        self._whole = False
        """All that is offered was read, or cannot be."""
        self._waiting: dict[str, deque[ListAsk | tuple[bytes, int]]] = {}
        self._bucket = Bucket(0.0)

    @property
    def _offered(self) -> tuple[OfferedRecording, ...]:
        return self._own.recordings[:MOST_OFFERED] if self._own.is_on else ()

    def on_own(self, own: OwnRecordings) -> None:
        if own.recordings != self._own.recordings:
            self._whole = False
            self._paths = {each.path for each in own.recordings}
        self._own, self._bucket.bytes_per_s = own, float(own.bytes_per_s)

    async def run(self) -> None:
        """Hashes what others have asked for; until cancelled."""
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            offered = self._offered
            for each in offered:
                await self._hash(each)
            # One that newer ones have pushed off the list is given on: somebody may be fetching it.
            self._read = {path: read for path, read in self._read.items() if path in self._paths}
            self._whole = offered == self._offered

    def on_asked(self, station: str, asked: Asked) -> None:
        waiting = self._waiting.get(station)
        if waiting is None:
            if len(self._waiting) >= MOST_STATIONS:
                return
            waiting = self._waiting[station] = deque()
        if isinstance(asked, ListAsk):
            self._wanted.set()
            if not any(isinstance(each, ListAsk) for each in waiting):
                waiting.appendleft(asked)
            return
        for offset in asked.offsets:
            if len(waiting) < _WAITING and (asked.sha256, offset) not in waiting:
                waiting.append((asked.sha256, offset))

    async def turn(self, now_s: float) -> list[tuple[str, Given]]:
        """What is to be sent now, and to whom: each of those that wait in its turn."""
        given = list[tuple[str, Given]]()
        while self._waiting and len(given) < _TURN_PIECES:
            station = next(iter(self._waiting))
            waiting = self._waiting[station]
            if waiting and not self._bucket.take(
                _LIST_BYTES if isinstance(waiting[0], ListAsk) else PIECE_BYTES, now_s
            ):
                break
            del self._waiting[station]
            if waiting:
                asked = waiting.popleft()
                self._waiting[station] = waiting
                given.append((station, await self._answer(asked)))
        return given

    async def _answer(self, asked: ListAsk | tuple[bytes, int]) -> Given:
        if isinstance(asked, ListAsk):
            return self._list(asked.first)
        sha256, offset = asked
        if not self._own.is_on:
            return NoPiece(sha256, OFF)
        found = next(
            (read for path, read in self._read.items() if path in self._paths and read.offer.sha256 == sha256), None
        )
        if found is None:
            self._wanted.set()
            return NoPiece(sha256, REMOVED if self._whole else LOOKING)
        data = await asyncio.to_thread(_piece, found, offset)
        return PieceGive(sha256, offset, data) if isinstance(data, bytes) else NoPiece(sha256, data)

    def _listed(self) -> list[_Read]:
        return [read for each in self._offered if (read := self._read.get(each.path)) is not None]

    def _list(self, first: int) -> ListGive:
        listed = self._listed()
        edition = crc32(b"".join(read.offer.sha256 for read in listed))
        unread = sum(each.path not in self._read and each.path not in self._unreadable for each in self._offered)
        offers = tuple(read.offer for read in listed[first : first + OFFERS_AT_ONCE])
        return ListGive(self._own.is_on, edition, len(listed), unread, first, offers)

    async def _hash(self, of: OfferedRecording) -> None:
        path = Path(of.path)
        look = await asyncio.to_thread(_look, path)
        known = self._read.get(of.path)
        if look is not None and (self._unreadable.get(of.path) == look or (known is not None and known.look == look)):
            return
        self._read.pop(of.path, None)
        if look is None or not 0 < look[1] <= MOST_RECORDING_BYTES:
            self._unreadable[of.path] = look or (0, 0, 0)
            return
        try:
            sha256 = await hashed(path, look[1])
        except OSError:
            sha256 = None
        if sha256 is None or await asyncio.to_thread(_look, path) != look:
            self._unreadable[of.path] = look
            _log.warning("%s cannot be read or has changed meanwhile: other stations are not told of it.", path.name)
            return
        self._unreadable.pop(of.path, None)
        self._read[of.path] = _Read(path, look, offer(of, sha256, look[1]))


async def hashed(path: Path, size: int) -> bytes | None:
    """SHA-256 of a file of that size, read in a thread; None: it has another size. Raises OSError."""
    digest = hashlib.sha256()

    def read_on(at: int) -> int:
        with path.open("rb") as file:
            file.seek(at)
            block = file.read(READ_BYTES)
        digest.update(block)
        return len(block)

    at = 0
    while at <= size and (read := await asyncio.to_thread(read_on, at)):
        at += read
    return digest.digest() if at == size else None


def _look(path: Path) -> Look | None:
    """None: it is no regular file, or gone."""
    try:
        status = path.stat(follow_symlinks=False)
    except OSError:
        return None
    return _look_of(status) if stat.S_ISREG(status.st_mode) else None


def _look_of(status: os.stat_result) -> Look:
    return status.st_ino, status.st_size, status.st_mtime_ns


def _piece(read: _Read, offset: int) -> bytes | int:
    """Or why there is none."""
    try:
        file = os.open(read.path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        return REMOVED
    try:
        if _look_of(os.fstat(file)) != read.look:
            return CHANGED
        return os.pread(file, PIECE_BYTES, offset) or CHANGED
    except OSError:
        return REMOVED
    finally:
        os.close(file)
