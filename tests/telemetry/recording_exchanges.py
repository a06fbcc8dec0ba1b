"""Two stations' exchange of recordings without a router: messages are handed over, time is the test's own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import msgspec

from telemetry.stations.recordings.asked_and_given import Given, gives_key
from telemetry.stations.recordings.exchange import Exchange
from telemetry.topics.station_recordings import (
    FetchRecording,
    FetchStatus,
    ListRecordings,
    OfferedRecording,
    OwnRecordings,
    StationRecordings,
)

TURN_S = 0.05
TURNS = 4000


def offered(path: Path, name: str = "") -> OfferedRecording:
    return OfferedRecording(str(path), name or path.name, path.stat().st_size, 1.7e9, 1.7e9 + 60, "Vehicle 1", "Ridge")


class Pair:
    """Alpha fetches into ``folder``, Bravo offers. ``carry``: what becomes of a message on its way; None: lost."""

    def __init__(self, folder: Path, carry: Callable[[bytes], list[bytes]] = lambda payload: [payload]) -> None:
        self.alpha, self.bravo = Exchange("Alpha", folder), Exchange("Bravo", None)
        self.carry, self.now_s, self.live = carry, 100.0, {"Bravo"}
        self.alpha.on_own(OwnRecordings(0.0, is_on=True, bytes_per_s=1_000_000))

    def offer(self, *recordings: OfferedRecording, is_on: bool = True) -> None:
        self.bravo.on_own(OwnRecordings(0.0, is_on, 1_000_000, recordings))

    async def turn(self) -> None:
        self.now_s += TURN_S
        for key, payload in await self.alpha.turn(self.live, self.now_s):
            if self.live:
                for each in self.carry(payload):
                    self.bravo.on_message(key, each, self.now_s)
        for key, payload in await self.bravo.turn({"Alpha"}, self.now_s):
            if self.live:
                for each in self.carry(payload):
                    self.alpha.on_message(key, each, self.now_s)
        await asyncio.sleep(0.001)  # what threads have read is taken up

    def says(self, given: Given) -> None:
        """Bravo, whatever it is: a hostile station."""
        self.alpha.on_message(gives_key("Bravo", "Alpha"), msgspec.msgpack.encode(given), self.now_s)

    async def until(self, holds: Callable[[], bool]) -> None:
        for _ in range(TURNS):
            if holds():
                return
            await self.turn()
        raise AssertionError(f"it does not come to that: {self.alpha.status(self.now_s)}")

    async def listed(self, count: int = 1) -> StationRecordings:
        await self.alpha.handle(ListRecordings("Bravo"))
        await self.until(lambda: len(self.list.recordings) == count and self.list.state == "listed")
        return self.list

    @property
    def list(self) -> StationRecordings:
        return self.alpha.status(self.now_s).stations[0]

    @property
    def fetch(self) -> FetchStatus:
        return self.alpha.status(self.now_s).fetches[0]

    async def begin(self) -> FetchStatus:
        """The first that is listed."""
        (first, *_) = (await self.listed()).recordings
        await self.alpha.handle(FetchRecording("Bravo", first.sha256))
        return self.fetch

    async def fetched(self) -> FetchStatus:
        await self.until(lambda: self.fetch.state in ("whole", "failed"))
        return self.fetch


@asynccontextmanager
async def running(*exchanges: Exchange) -> AsyncIterator[None]:
    tasks = [asyncio.ensure_future(each.run()) for each in exchanges]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
