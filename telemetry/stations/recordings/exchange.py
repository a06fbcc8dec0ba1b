"""Recordings between this station and the others: what is asked and given both ways, in turns, and what is known."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Collection
from pathlib import Path

import msgspec

from telemetry.errors import StationsError
from telemetry.stations.recordings.asked_and_given import (
    MESSAGE_BYTES,
    Asked,
    Given,
    ListGive,
    NoPiece,
    PieceGive,
    asks_key,
    gives_key,
    read_key,
)
from telemetry.stations.recordings.fetch_folder import FetchFolder
from telemetry.stations.recordings.fetching import Fetching
from telemetry.stations.recordings.listing import Listing
from telemetry.stations.recordings.offering import Offering
from telemetry.stations.station_messages import decode
from telemetry.stations.station_names import MOST_STATIONS, checked_name
from telemetry.topics.station_recordings import (
    EndFetch,
    FetchRecording,
    ListRecordings,
    OwnRecordings,
    RecordingsRequest,
    RecordingsStatus,
)

_log = logging.getLogger(__name__)


class Exchange:
    """All methods belong to one event loop. ``folder``: where what is fetched lies until it is whole; None: nothing is
    fetched."""

    def __init__(self, own: str, folder: Path | None) -> None:
        self._own = own
        self._offering = Offering()
        self._fetching = None if folder is None else Fetching(FetchFolder(folder))
        self._lists: dict[str, Listing] = {}
        self.refused = 0

    async def run(self) -> None:
        """Until cancelled."""
        if self._fetching is not None:
            try:
                await self._fetching.take_up()
            except StationsError as error:
                _log.warning("%s", error.what)
        async with asyncio.TaskGroup() as group:
            group.create_task(self._offering.run())
            if self._fetching is not None:
                group.create_task(self._fetching.run())

    def on_own(self, own: OwnRecordings) -> None:
        self._offering.on_own(own)
        if self._fetching is not None:
            self._fetching.bucket.bytes_per_s = float(own.bytes_per_s)

    async def handle(self, request: RecordingsRequest) -> None:
        """Of the server. Raises StationsError."""
        match request:
            case ListRecordings(station):
                self._list_of(checked_name(station)).ask()
            case FetchRecording(station, sha256):
                listing = self._lists.get(station)
                there = None if listing is None else listing.recording(sha256)
                if there is None:
                    raise StationsError(
                        f"{station} lists no such recording.", advice="Ask for its list, and choose one of it."
                    )
                await self._needed().begin(station, there)
            case EndFetch(sha256):
                await self._needed().end(sha256)

    def on_message(self, key: str, payload: bytes, now_s: float) -> None:
        """Another machine's word; what is refused is counted."""
        try:
            station, asks = read_key(key, self._own)
            if asks:
                self._offering.on_asked(station, decode(payload, Asked, MESSAGE_BYTES))  # type: ignore[arg-type]
            else:
                self._on_given(station, decode(payload, Given, MESSAGE_BYTES), now_s)  # type: ignore[arg-type]
        except StationsError as error:
            self.refused += 1
            _log.debug("Refused: %s", error.what)

    async def turn(self, live: Collection[str], now_s: float) -> list[tuple[str, bytes]]:
        """Keys and messages that are to be sent now; ``live``: stations that are heard."""
        out = [
            (asks_key(self._own, station), msgspec.msgpack.encode(ask))
            for station, listing in self._lists.items()
            if (ask := listing.due(now_s, is_live=station in live)) is not None
        ]
        if self._fetching is not None and (asked := await self._fetching.turn(live, now_s)) is not None:
            out.append((asks_key(self._own, asked[0]), msgspec.msgpack.encode(asked[1])))
        for station, given in await self._offering.turn(now_s):
            out.append((gives_key(self._own, station), msgspec.msgpack.encode(given)))
        return out

    def status(self, now_s: float) -> RecordingsStatus:
        lists = tuple(self._lists[station].status() for station in sorted(self._lists))
        return RecordingsStatus(now_s, lists, () if self._fetching is None else self._fetching.statuses(now_s))

    def _on_given(self, station: str, given: Given, now_s: float) -> None:
        if isinstance(given, ListGive):
            listing = self._lists.get(station)
            if listing is not None:
                listing.on_list(given, now_s)
            return
        fetching = self._fetching
        if fetching is not None and isinstance(given, PieceGive):
            fetching.on_piece(station, given, now_s)
        elif fetching is not None and isinstance(given, NoPiece):
            fetching.on_none(station, given, now_s)

    def _list_of(self, station: str) -> Listing:
        """Raises StationsError."""
        if station not in self._lists and len(self._lists) >= MOST_STATIONS:
            raise StationsError(f"Recordings of more than {MOST_STATIONS} stations are not listed.")
        return self._lists.setdefault(station, Listing(station))

    def _needed(self) -> Fetching:
        if self._fetching is None:
            raise StationsError("This stations node has no folder for recordings that are fetched.")
        return self._fetching
