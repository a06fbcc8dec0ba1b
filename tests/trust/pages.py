"""How old a position is when a page has read it: one page alone, and fifty of them."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin

from tests.e2e.stations import SimulatedVehicle, Station
from tests.server.station import ok
from tests.trust.rows import Row, judged

PAGES = 50
SECONDS_EACH = 10.0
ROUNDS = 3
"""One and many by turns, so that a machine that is busy for a while is busy for both."""
SETTLE_S = 2.0
_VEHICLE = '"type":"vehicle"'


def pages_row(pages: int = PAGES, seconds: float = SECONDS_EACH) -> Row:
    """Real sockets to a real server, whose link hears a simulated vehicle."""
    with tempfile.TemporaryDirectory(prefix="hedgehop-trust-") as folder, _flown(Path(folder)) as station:
        one_s, all_s = asyncio.run(_by_turns(station, pages, seconds))
    figure = (
        f"the 99th of 100 positions is {_ms(one_s)} old on one page ({len(one_s)} read), "
        f"{_ms(all_s)} on {pages} ({len(all_s)} read)"
    )
    held = bool(one_s) and bool(all_s) and p99(all_s) <= 2.0 * p99(one_s)
    return Row("R14", f"{pages} browsers: no later than twice as late as one alone", judged(held), figure, "make trust")


@contextlib.contextmanager
def _flown(folder: Path) -> Iterator[Station]:
    station = Station(folder / "data")
    vehicle = SimulatedVehicle(speedup=1.0)
    try:
        station.sign_in()
        ok(station.http.post("/api/link/connect", json={"address": vehicle.address, "adopt": True}))
        yield station
    finally:
        vehicle.stop()
        station.stop()


async def _by_turns(station: Station, pages: int, seconds: float) -> tuple[list[float], list[float]]:
    one_s: list[float] = []
    all_s: list[float] = []
    async with _opened(station, 1) as (page,):
        await asyncio.wait_for(_first(page), 60.0)
    for _ in range(ROUNDS):
        one_s += await _ages_s(station, 1, seconds)
        all_s += await _ages_s(station, pages, seconds)
    return one_s, all_s


async def _first(page: ClientConnection) -> None:
    """A place is known."""
    async for text in page:
        if _age_s(str(text)) is not None:
            return


async def _ages_s(station: Station, pages: int, seconds: float) -> list[float]:
    ages_s: list[float] = []
    async with _opened(station, pages) as opened:
        begin_s = time.monotonic() + SETTLE_S  # a snapshot each, first

        async def read(page: ClientConnection) -> None:
            async for text in page:
                age_s = _age_s(str(text))
                if age_s is not None and time.monotonic() >= begin_s:
                    ages_s.append(age_s)

        readers = [asyncio.ensure_future(read(page)) for page in opened]
        await asyncio.sleep(SETTLE_S + seconds)
        for reader in readers:
            reader.cancel()
        await asyncio.gather(*readers, return_exceptions=True)
    return ages_s


@contextlib.asynccontextmanager
async def _opened(station: Station, pages: int) -> AsyncIterator[list[ClientConnection]]:
    async with contextlib.AsyncExitStack() as stack:
        cookie = "; ".join(f"{name}={value}" for name, value in station.cookies.items())
        yield [
            await stack.enter_async_context(
                connect(
                    f"{station.origin.replace('http', 'ws')}/ws",
                    origin=Origin(station.origin),
                    additional_headers={"Cookie": cookie},
                    max_size=None,
                    max_queue=None,
                    compression=None,
                )
            )
            for _ in range(pages)
        ]


def _age_s(text: str) -> float | None:
    now_s = time.monotonic()
    if _VEHICLE not in text[:80]:
        return None
    state = json.loads(text)["state"]
    at_s = None if state is None else state["position_t_mono_s"]
    return None if at_s is None else now_s - at_s


def p99(ages_s: list[float]) -> float:
    return sorted(ages_s)[math.ceil(0.99 * len(ages_s)) - 1]


def _ms(ages_s: list[float]) -> str:
    return f"{1000 * p99(ages_s):.0f} ms" if ages_s else "never"
