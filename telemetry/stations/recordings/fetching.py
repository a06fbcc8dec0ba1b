"""Recordings that are fetched from other stations, one after the other: asked for, written, checked."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Collection
from dataclasses import dataclass, field

from telemetry.errors import StationsError
from telemetry.stations.recordings.asked_and_given import (
    LOOKING,
    PIECES_AT_ONCE,
    WHY,
    NoPiece,
    PieceGive,
    PiecesAsk,
)
from telemetry.stations.recordings.fetch_folder import FetchFolder, Note, note_of
from telemetry.stations.recordings.listing import NOT_ANSWERED
from telemetry.stations.recordings.offering import hashed
from telemetry.stations.recordings.pieces import Bucket, Pieces
from telemetry.topics.station_recordings import FetchState, FetchStatus, RecordingThere

MOST_FETCHES = 8
LOOKS_AGAIN_S, NOT_ANSWERED_S, RATE_OVER_S = 5.0, 15.0, 10.0
SILENT_AGAIN_S = 60.0
"""After so long a station that does not answer is asked again, while others' recordings wait."""


@dataclass(slots=True)
class _Fetch:
    note: Note
    pieces: Pieces
    state: FetchState = "waiting"
    text: str = ""
    path: str = ""
    not_before_s: float = 0.0
    is_looked_for: bool = False
    """There, where it is not found yet."""
    heard_s: float | None = None
    """When a piece came last, or the first was asked for; None: not since its station is heard."""
    came: deque[tuple[float, int]] = field(default_factory=lambda: deque(maxlen=64))
    """Moments, and how many bytes were there."""


class Fetching:
    """Belongs to one event loop; the disk is left to threads. ``turn`` is called some ten times a second, ``run`` is to
    be running."""

    def __init__(self, folder: FetchFolder) -> None:
        self._folder = folder
        self._fetches: dict[str, _Fetch] = {}
        self._changing = asyncio.Lock()
        self._ready: deque[tuple[_Fetch, int, bytes]] = deque()
        self._to_check = asyncio.Event()
        self._silent_until_s: dict[str, float] = {}
        """By station: it does not answer, and others go first until then."""
        self.bucket = Bucket(0.0)

    async def run(self) -> None:
        """Looks at what has come whole, which takes a while for a long one; until cancelled."""
        while True:
            await self._to_check.wait()
            self._to_check.clear()
            for fetch in [each for each in self._fetches.values() if each.state == "checking"]:
                await self._check(fetch)

    async def take_up(self) -> None:
        """What a process before this one has left. Raises StationsError."""
        for note in (await asyncio.to_thread(self._folder.begun))[:MOST_FETCHES]:
            have = await asyncio.to_thread(self._folder.have, note)
            fetch = self._fetches.setdefault(note.sha256, _Fetch(note, Pieces(note.size_bytes, have)))
            whole = self._folder.whole(note)
            if await asyncio.to_thread(whole.is_file):
                fetch.state, fetch.path = "whole", str(whole)

    async def begin(self, station: str, it: RecordingThere) -> None:
        """One that failed goes on from what is there. Raises StationsError: no room, or too many of them."""
        async with self._changing:
            before = self._fetches.get(it.sha256)
            if before is not None and before.state != "failed":
                if before.note.station != station:
                    raise StationsError(
                        f"{it.name} is being fetched from {before.note.station}, the same bytes.",
                        advice="Wait for it, or cancel that one first.",
                    )
                return
            if before is None and len(self._fetches) >= MOST_FETCHES:
                raise StationsError(
                    f"{MOST_FETCHES} recordings are being fetched already.",
                    advice="Wait until one has come, or cancel one.",
                )
            note = note_of(station, it)
            others = (each for each in self._fetches.values() if each is not before and each.state != "failed")
            missing = sum(each.note.size_bytes - each.pieces.have for each in others)
            have = await asyncio.to_thread(self._folder.begin, note, missing)
            self._fetches.pop(it.sha256, None)
            self._fetches[it.sha256] = _Fetch(note, Pieces(note.size_bytes, have))

    async def end(self, sha256: str) -> None:
        """Whatever it has come to. Raises StationsError where the disk keeps it."""
        async with self._changing:
            fetch = self._fetches.pop(sha256, None)
            if fetch is not None:
                await asyncio.to_thread(self._folder.delete, fetch.note)

    def on_piece(self, station: str, given: PieceGive, now_s: float) -> None:
        fetch = self._asked_of(station, given.sha256)
        if fetch is None:
            return
        at = fetch.pieces.have
        try:
            data = fetch.pieces.on_piece(given.offset, given.data, now_s)
        except StationsError as error:
            _fail(fetch, f"What {station} sends is not what was asked for: {error.what} Call its crew.")
            return
        self._on_answer(fetch, now_s)
        if data:
            self._ready.append((fetch, at, data))
            fetch.came.append((now_s, fetch.pieces.have))

    def on_none(self, station: str, given: NoPiece, now_s: float) -> None:
        fetch = self._asked_of(station, given.sha256)
        if fetch is None:
            return
        fetch.pieces.forget_asked()
        self._on_answer(fetch, now_s)
        if given.why == LOOKING:
            fetch.not_before_s, fetch.is_looked_for = now_s + LOOKS_AGAIN_S, True
            return
        _fail(fetch, f"{station} does not have it any more: {WHY[given.why]}. Ask for its list anew.")

    async def turn(self, live: Collection[str], now_s: float) -> tuple[str, PiecesAsk] | None:
        """Whom to ask for what now; ``live``: stations that are heard."""
        async with self._changing:
            await self._write()
            for each in self._fetches.values():
                if each.state in ("waiting", "fetching") and each.pieces.is_whole:
                    each.state, each.text = "checking", ""
                    self._to_check.set()
            for station in [each for each in self._silent_until_s if each not in live]:
                del self._silent_until_s[station]
            # In the order in which they were begun, which stays: one that cannot go on holds up none behind it.
            begun = [each for each in self._fetches.values() if each.state in ("waiting", "fetching")]
            chosen = self._chosen([each for each in begun if each.note.station in live], now_s)
            for each in begun:
                if each is not chosen:
                    self._wait(each, live, chosen)
            return None if chosen is None else self._ask(chosen, now_s)

    def _chosen(self, heard: list[_Fetch], now_s: float) -> _Fetch | None:
        """The first that may go on; where none may, of those whose station does not answer the one that was longest not
        asked."""
        ready = [each for each in heard if now_s >= each.not_before_s]
        silent_until_s = self._silent_until_s
        return min(ready, key=lambda each: max(now_s, silent_until_s.get(each.note.station, now_s)), default=None)

    def _wait(self, fetch: _Fetch, live: Collection[str], ahead: _Fetch | None) -> None:
        """Says what it waits for."""
        station = fetch.note.station
        if station not in live:
            text = f"{station} is not heard: it goes on by itself once it is."
            if fetch.text != text:
                fetch.pieces.forget_asked()
        else:
            turn = "" if ahead is None else f"It waits for {ahead.note.name} of {ahead.note.station}."
            text = self._why_late(fetch) or turn
        fetch.state, fetch.text, fetch.heard_s = "waiting", text, None

    def _why_late(self, fetch: _Fetch) -> str:
        station = fetch.note.station
        if station in self._silent_until_s:
            return f"{NOT_ANSWERED.format(station=station)} It is asked again."
        return f"{station} is asked again: {WHY[LOOKING]}." if fetch.is_looked_for else ""

    def _on_answer(self, fetch: _Fetch, now_s: float) -> None:
        self._silent_until_s.pop(fetch.note.station, None)
        fetch.heard_s, fetch.is_looked_for = now_s, False

    def _ask(self, fetch: _Fetch, now_s: float) -> tuple[str, PiecesAsk] | None:
        station = fetch.note.station
        if fetch.state == "waiting":
            fetch.state, fetch.heard_s = "fetching", now_s
        if fetch.heard_s is not None and now_s - fetch.heard_s > NOT_ANSWERED_S:
            fetch.heard_s = now_s
            self._silent_until_s[station] = now_s + SILENT_AGAIN_S
        fetch.text = self._why_late(fetch)
        offsets = fetch.pieces.due(self.bucket, now_s, PIECES_AT_ONCE)
        return (station, PiecesAsk(bytes.fromhex(fetch.note.sha256), tuple(offsets))) if offsets else None

    async def _write(self) -> None:
        while self._ready:
            fetch, at, data = self._ready[0]
            if fetch.state != "failed" and self._fetches.get(fetch.note.sha256) is fetch:
                try:
                    await asyncio.to_thread(self._folder.write, fetch.note, at, data)
                except StationsError as error:
                    _fail(fetch, f"{error.what} {error.advice}")
            # Only now: where the turn is cancelled, for a wire that is opened anew, it is written again.
            self._ready.popleft()

    async def _check(self, fetch: _Fetch) -> None:
        note = fetch.note
        digest, fault = None, ""
        try:
            digest = await hashed(self._folder.part(note), note.size_bytes)
        except OSError as error:
            fault = (
                f"{note.name} has come and cannot be read here ({error.strerror or error}): see to this station's own "
                "disk. What came is kept: Again reads it once more."
            )
        async with self._changing:
            if self._fetches.get(note.sha256) is not fetch:
                return
            if fault:
                _fail(fetch, fault)
            else:
                await self._settle(fetch, digest)

    async def _settle(self, fetch: _Fetch, digest: bytes | None) -> None:
        note = fetch.note
        try:
            if digest is not None and digest.hex() == note.sha256:
                fetch.path = str(await asyncio.to_thread(self._folder.finish, note))
                fetch.state = "whole"
                return
            await asyncio.to_thread(self._folder.delete, note)
        except StationsError as error:
            _fail(fetch, f"{error.what} {error.advice}")
            return
        fetch.pieces = Pieces(note.size_bytes, 0)
        if digest is None:
            _fail(
                fetch,
                f"{note.name} lies here in another length than it was written in: it was deleted. Fetch it again.",
            )
            return
        _fail(
            fetch,
            f"What came from {note.station} is not {note.name}: its SHA-256 is another one. It was deleted. Fetch it "
            "again; where that happens again, call its crew.",
        )

    def _asked_of(self, station: str, sha256: bytes) -> _Fetch | None:
        """One that goes on, or waits while pieces that it asked for are under way, and comes from there."""
        fetch = self._fetches.get(sha256.hex())
        goes_on = fetch is not None and fetch.note.station == station and fetch.state in ("fetching", "waiting")
        return fetch if goes_on else None

    def statuses(self, now_s: float) -> tuple[FetchStatus, ...]:
        return tuple(
            FetchStatus(
                fetch.note.station,
                fetch.note.it,
                fetch.state,
                fetch.pieces.have,
                _rate(fetch, now_s),
                fetch.text,
                fetch.path,
            )
            for fetch in self._fetches.values()
        )


def _fail(fetch: _Fetch, text: str) -> None:
    fetch.state, fetch.text = "failed", text


def _rate(fetch: _Fetch, now_s: float) -> float:
    """Bytes per second, of the last ones."""
    if fetch.state != "fetching":
        return 0.0
    came = [(at_s, have) for at_s, have in fetch.came if now_s - at_s <= RATE_OVER_S]
    if len(came) < 2:
        return 0.0
    return (came[-1][1] - came[0][1]) / max(now_s - came[0][0], 0.1)
