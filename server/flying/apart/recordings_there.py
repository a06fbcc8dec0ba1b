"""Recordings of other stations: listed when somebody looks, fetched when an operator asks, then among one's own.

The *stations* node does all of it that touches the network; here own ones are offered, and what came is read by the
same confined worker as a file that was dropped in.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine
from datetime import datetime
from pathlib import Path
from typing import Any

from server.errors import BusyError, InUseError, NotReadyError, StorageError, error_doc, reported
from server.flying.recordings import RecordingDesk
from server.heard.node_states import Nodes
from server.heard.relay import Relay
from server.library.recording_list import plain_name, sha256_of_fetched
from server.library.sharing.versions import pulled_recordings
from server.library.shelf import iso_utc
from server.schemas import (
    Pages,
    RecordingDoc,
    RecordingFetchDoc,
    RecordingsThereDoc,
    RecordingThereDoc,
    ServerMessage,
    StationFetchesMessage,
    StationRecordingsDoc,
    StationRecordingsMessage,
)
from telemetry.bus.bus import Bus
from telemetry.errors import RecordingError, RecordingUnreadableError
from telemetry.topics.messages import Topic
from telemetry.topics.station_recordings import (
    EndFetch,
    FetchRecording,
    FetchStatus,
    ListRecordings,
    OfferedRecording,
    OwnRecordings,
    RecordingsStatus,
    RecordingThere,
    StationRecordings,
)
from telemetry.topics.station_vehicles import OtherStation, StationsStatus

log = logging.getLogger("hedgehop.flying")

TELL_EVERY_S, LIST_EVERY_S, AGAIN_S, TELL_FETCH_S = 1.0, 5.0, 10.0, 2.0
FRESH_S, PRESSED_S = 30.0, 3.0
"""Whoever looks has a list asked for anew that is older; whoever asks by a press, one that is older than the second."""


class RecordingsThere:
    """All methods belong to the event loop; files are left to threads and workers."""

    def __init__(
        self,
        bus: Bus,
        nodes: Nodes,
        pages: Pages,
        desk: RecordingDesk,
        stations: Callable[[], StationsStatus | None],
        *,
        is_on: bool,
        kb_s: int,
        now_mono_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """``stations``: which of them are heard; ``is_on``: others may fetch from here."""
        self._bus, self._nodes, self._pages, self._desk, self._stations = bus, nodes, pages, desk, stations
        self._is_on, self._bytes_per_s, self._now_mono_s = is_on, 1000 * kb_s, now_mono_s
        self._status = RecordingsStatus(0.0)
        self._own: tuple[OfferedRecording, ...] = ()
        self._here: dict[tuple[str, int], str] = {}
        """Ids of those that were fetched, by SHA-256 and bytes: names are given twice."""
        self._wrong: dict[str, tuple[RecordingThere, str, str]] = {}
        """By SHA-256: what came and is no recording, from where, and why."""
        self._taking: dict[str, str] = {}
        """By SHA-256: why it is tried to be opened again."""
        self._dealt: dict[str, bool] = {}
        """By SHA-256: what was read, is no recording, or was cancelled, until its node tells of it no more; whether
        that was asked to put it away. A word of before is not taken for another one to read."""
        self._unread: dict[str, str] = {}
        """By SHA-256: what came whole and could not be opened, and why; it is kept until somebody presses *Again*."""
        self._told_lists: object = None
        self._told_fetches: tuple[object, object] = None, None
        self._told_s = 0.0
        self._came = asyncio.Event()

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        relay = Relay(self._bus)
        relay.on(Topic.STATIONS_RECORDINGS, self.on_status)
        return [*relay.loops(), self._offer(), self._list(), self._take_in()]

    def on_status(self, status: RecordingsStatus) -> None:
        """Lists are long: pages are told of them when one has changed, and how far a fetch is every two seconds."""
        self._status = status
        told = {fetch.it.sha256 for fetch in status.fetches}
        for known in (self._taking, self._dealt, self._unread):
            for sha256 in known.keys() - told:
                del known[sha256]
        heard = [(name, station.state) for name, station in self._heard().items()]
        lists = status.stations, heard, self._here.copy()
        if lists != self._told_lists:
            self._told_lists = lists
            self._pages.publish(self._lists_message())
        now_s, before = self._now_mono_s(), self._told_fetches
        states = [(fetch.it.sha256, fetch.state, fetch.text) for fetch in status.fetches]
        have = [fetch.have_bytes for fetch in status.fetches]
        if states != before[0] or (have != before[1] and now_s - self._told_s >= TELL_FETCH_S):
            self._told_fetches, self._told_s = (states, have), now_s
            self._tell_fetches()
        if any(self._is_done(fetch) for fetch in status.fetches):
            self._came.set()

    # Asked by pages and programs

    def doc(self) -> RecordingsThereDoc:
        return RecordingsThereDoc(
            now_mono_s=self._now_mono_s(),
            is_offered=self._is_on,
            kb_s=self._bytes_per_s // 1000,
            stations=self._station_docs(),
            fetches=self._fetch_docs(),
        )

    def messages(self) -> list[ServerMessage]:
        """What a page is told first."""
        return [self._lists_message(), StationFetchesMessage(fetches=self._fetch_docs())]

    async def look(self, fresh_s: float = FRESH_S) -> None:
        """Has each station that is heard asked for its list, unless it is younger or under way. Raises BusError."""
        now_s, lists = self._now_mono_s(), {each.station: each for each in self._status.stations}
        for name, station in self._heard().items():
            known = lists.get(name)
            is_fresh = known is not None and (
                known.state == "asking" or (known.as_of_t_mono_s is not None and now_s - known.as_of_t_mono_s < fresh_s)
            )
            if station.state == "live" and not is_fresh:
                await self._nodes.ask_stations(ListRecordings(name))

    async def fetch(self, station: str, sha256: str) -> None:
        """Raises StationsError, InUseError, NotReadyError, BusError."""
        listed = [it for each in self._status.stations if each.station == station for it in each.recordings]
        there = next((it for it in listed if it.sha256 == sha256), None)
        if there is not None and _key(there) in self._here:
            raise InUseError(f"{there.name} of {station} was fetched already.", advice="Open it in the list.")
        heard = self._heard().get(station)
        if heard is not None and heard.state == "lost":
            raise NotReadyError(f"{station} is not heard.", advice="Fetch it once it is heard again.")
        self._wrong.pop(sha256, None)
        if self._unread.pop(sha256, None) is not None and self._has_whole(station, sha256):
            self._came.set()
            self._tell_fetches()
            return
        self._taking.pop(sha256, None)
        self._dealt.pop(sha256, None)
        await self._nodes.ask_stations(FetchRecording(station, sha256))

    async def end(self, sha256: str) -> None:
        """Cancels it, or puts away what it came to. Raises StationsError, BusError."""
        self._wrong.pop(sha256, None)
        self._unread.pop(sha256, None)
        self._taking.pop(sha256, None)
        self._dealt[sha256] = True
        try:
            await self._nodes.ask_stations(EndFetch(sha256))
        except Exception:
            self._dealt.pop(sha256, None)
            raise
        self._tell_fetches()

    # Own ones

    async def _offer(self) -> None:
        while True:
            own = OwnRecordings(self._now_mono_s(), self._is_on, self._bytes_per_s, self._own)
            self._bus.publish(Topic.STATIONS_OFFERED, own)
            await asyncio.sleep(TELL_EVERY_S)

    async def _list(self) -> None:
        """What cannot be listed ends nothing: it is listed again."""
        while True:
            try:
                await self.list_own()
            except Exception as error:
                doing = "Listing recordings for other stations"
                log.warning("%s: %s", doing, reported(error, log, doing).what)
            await asyncio.sleep(LIST_EVERY_S)

    async def list_own(self) -> None:
        """Raises StorageError."""
        shelved = await self._desk.shelved()
        pulled = await asyncio.to_thread(pulled_recordings, self._desk.root) if self._is_on else frozenset[str]()
        self._here = await asyncio.to_thread(_fetched, shelved)
        self._own = tuple(
            _offered(str(path), doc)
            for path, doc in shelved
            if self._is_on and not doc.station and path.name not in pulled and plain_name(path) == path.name
        )

    # Those that have come

    async def _take_in(self) -> None:
        while True:
            await self._came.wait()
            self._came.clear()
            for fetch in [each for each in self._status.fetches if self._is_done(each)]:
                if self._is_done(fetch) and not await self._take(fetch):
                    await asyncio.sleep(AGAIN_S)
                    self._came.set()

    async def _take(self, fetch: FetchStatus) -> bool:
        """False: it is to be tried again."""
        sha256 = fetch.it.sha256
        if sha256 not in self._dealt:
            is_tried_again = await self._read(fetch)
            if self._dealt.get(sha256) or sha256 in self._unread:
                return True
            if is_tried_again:
                return False
            self._dealt[sha256] = False
        try:
            await self._nodes.ask_stations(EndFetch(sha256))
        except Exception as error:
            log.warning("Putting away what was fetched: %s", reported(error, log, "Putting away what was fetched").what)
            return False
        self._dealt[sha256] = True
        return True

    async def _read(self, fetch: FetchStatus) -> bool:
        """True: it is to be tried again."""
        it = fetch.it
        try:
            if fetch.state == "whole" and not self._is_here(fetch):
                doc = await self._desk.add_fetched(fetch.path, it.name, fetch.station, it.sha256)
                self._here[_key(it)] = doc.id
        except Exception as error:
            if not self._dealt.get(it.sha256):  # else it was cancelled meanwhile: its file is gone
                return self._on_unread(fetch, error)
        self._taking.pop(it.sha256, None)
        return False

    def _on_unread(self, fetch: FetchStatus, error: Exception) -> bool:
        it = fetch.it
        self._taking.pop(it.sha256, None)
        doing = f"Taking in {it.name} of {fetch.station}"
        if isinstance(error, RecordingError) and not isinstance(error, RecordingUnreadableError):
            self._wrong[it.sha256] = it, fetch.station, f"It came whole, and is no recording: {_words(error)}"
            return False
        log.warning("%s: %s", doing, reported(error, log, doing).what)
        if is_tried_again := isinstance(error, (BusyError, StorageError)):
            self._taking[it.sha256] = f"It has come, and is tried to be opened again: {_words(error)}"
        else:  # It may be the disk, or the file: read again by itself it would end a worker every ten seconds.
            self._unread[it.sha256] = f"It came whole, and could not be opened: {_words(error)} It is kept."
        self._tell_fetches()
        return is_tried_again

    def _is_done(self, fetch: FetchStatus) -> bool:
        """It came whole; or it came before, and the node was not told in time that it was taken in."""
        if fetch.it.sha256 in self._unread or self._dealt.get(fetch.it.sha256):
            return False
        return fetch.state == "whole" or (fetch.have_bytes == 0 and self._is_here(fetch))

    def _has_whole(self, station: str, sha256: str) -> bool:
        return any(
            (each.station, each.it.sha256, each.state) == (station, sha256, "whole") for each in self._status.fetches
        )

    def _is_here(self, fetch: FetchStatus) -> bool:
        return _key(fetch.it) in self._here

    # For pages

    def _heard(self) -> dict[str, OtherStation]:
        status = self._stations()
        return {} if status is None else {station.name: station for station in status.stations}

    def _lists_message(self) -> StationRecordingsMessage:
        return StationRecordingsMessage(stations=self._station_docs())

    def _tell_fetches(self) -> None:
        self._pages.publish(StationFetchesMessage(fetches=self._fetch_docs()))

    def _station_docs(self) -> list[StationRecordingsDoc]:
        now_s, heard = self._now_mono_s(), self._heard()
        lists = {each.station: each for each in self._status.stations}
        return [self._station_doc(name, heard.get(name), lists.get(name), now_s) for name in sorted({*heard, *lists})]

    def _fetch_docs(self) -> list[RecordingFetchDoc]:
        return [*map(self._fetch_doc, self._status.fetches), *self._wrong_docs()]

    def _station_doc(
        self, name: str, heard: OtherStation | None, known: StationRecordings | None, now_s: float
    ) -> StationRecordingsDoc:
        as_of_s = None if known is None else known.as_of_t_mono_s
        return StationRecordingsDoc(
            name=name,
            state="lost" if heard is None else heard.state,
            listed="no" if known is None else known.state,
            age_s=None if as_of_s is None else max(0.0, now_s - as_of_s),
            text="" if known is None else known.text,
            recordings=[] if known is None else [self._recording_doc(it) for it in known.recordings],
        )

    def _recording_doc(self, it: RecordingThere) -> RecordingThereDoc:
        begin_s, end_s = it.begin_utc_s, it.end_utc_s
        return RecordingThereDoc(
            sha256=it.sha256,
            name=it.name,
            bytes=it.size_bytes,
            started_utc=None if begin_s is None else iso_utc(begin_s),
            duration_s=None if begin_s is None or end_s is None or end_s < begin_s else end_s - begin_s,
            vehicle=it.vehicle,
            plan_name=it.plan,
            recording_id=self._here.get(_key(it)),
        )

    def _fetch_doc(self, fetch: FetchStatus) -> RecordingFetchDoc:
        left = fetch.it.size_bytes - fetch.have_bytes
        unread = self._unread.get(fetch.it.sha256) if fetch.state == "whole" else None
        return RecordingFetchDoc(
            station=fetch.station,
            sha256=fetch.it.sha256,
            name=fetch.it.name,
            bytes=fetch.it.size_bytes,
            have_bytes=fetch.have_bytes,
            state=fetch.state if unread is None else "failed",
            left_s=left / fetch.bytes_per_s if fetch.bytes_per_s > 0 and fetch.state == "fetching" else None,
            text=unread or self._taking.get(fetch.it.sha256, fetch.text),
        )

    def _wrong_docs(self) -> list[RecordingFetchDoc]:
        return [
            RecordingFetchDoc(
                station=station,
                sha256=it.sha256,
                name=it.name,
                bytes=it.size_bytes,
                have_bytes=0,
                state="failed",
                left_s=None,
                text=text,
            )
            for it, station, text in self._wrong.values()
        ]


def _key(it: RecordingThere) -> tuple[str, int]:
    return it.sha256, it.size_bytes


def _fetched(shelved: list[tuple[Path, RecordingDoc]]) -> dict[tuple[str, int], str]:
    """For threads."""
    fetched = [(sha256_of_fetched(path), doc) for path, doc in shelved if doc.station]
    return {(sha256, doc.bytes): doc.id for sha256, doc in fetched if sha256}


def _offered(path: str, doc: RecordingDoc) -> OfferedRecording:
    begin_s = datetime.fromisoformat(doc.started_utc).timestamp()
    end_s = None if doc.duration_s is None else begin_s + doc.duration_s
    return OfferedRecording(path, doc.name, doc.bytes, begin_s, end_s, doc.vehicle, doc.plan_name)


def _words(error: Exception) -> str:
    doc = error_doc(error)
    return " ".join(filter(None, (doc.what, doc.advice)))
