"""Stations as processes around a router: a recording is listed, fetched, and fetched on after a kill."""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import queue
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from pathlib import Path

import msgspec
import numpy as np
import pytest
import zenoh

from server.door.station_files import ROUTER_FILE
from telemetry.stations.recordings.asked_and_given import (
    ROOT,
    ListAsk,
    PieceGive,
    asks_key,
    gives_key,
    meant_for,
)
from telemetry.topics.station_recordings import EndFetch, ListRecordings
from tests.telemetry.bad_line import Bad
from tests.telemetry.bus_runs import PATIENCE_S, run, short_folder
from tests.telemetry.station_fleet import Field, station_session
from tests.telemetry.stations_fetch_bench import measure_fetch

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]

NAMES = ("Alpha", "Bravo", "Charlie")
WHOLE_S = 4 * PATIENCE_S


def test_a_recording_is_listed_and_fetched_and_fetched_on_after_both_were_killed() -> None:
    async def whole(folder: Path) -> None:
        field = Field(folder, ("Alpha", "Bravo"))
        flight = folder / "flight.mcap"
        flight.write_bytes(content := os.urandom(400_123))
        async with AsyncExitStack() as stack:
            stack.callback(field.router.kill)
            await field.router.start()
            alpha = await stack.enter_async_context(field.station("Alpha"))
            bravo = await stack.enter_async_context(field.station("Bravo"))
            bravo.offer(flight)
            alpha.offer(bytes_per_s=60_000)
            await alpha.sees("Bravo")
            assert alpha.recordings.stations == ()  # nothing is asked for before somebody wants it
            await alpha.asks(ListRecordings("Bravo"))
            sha256 = await alpha.fetch("Bravo", "flight.mcap")
            assert sha256 == hashlib.sha256(content).hexdigest()
            await alpha.fetches(lambda fetch: fetch.have_bytes > 100_000)
            await alpha.start_again()
            again = await alpha.fetches(lambda fetch: fetch.state == "fetching" and fetch.bytes_per_s > 0)
            assert again.have_bytes >= 100_000 - 100_000 % 1200
            await bravo.start_again()  # its SHA-256 are to be computed anew
            done = await alpha.fetches(lambda fetch: fetch.state in ("whole", "failed"))
            assert (done.state, done.text) == ("whole", "")
            assert Path(done.path).read_bytes() == content
            await alpha.asks(EndFetch(sha256))
            assert list(alpha.fetched.iterdir()) == []

    _in_folder(whole)


def test_a_third_station_hears_nothing_of_it_and_can_give_nothing_in_anothers_name() -> None:
    """Charlie, by hand, with a whole certificate of its own."""

    async def whole(folder: Path) -> None:
        field = Field(folder, NAMES)
        flight = folder / "flight.mcap"
        flight.write_bytes(os.urandom(200_000))
        async with AsyncExitStack() as stack:
            stack.callback(field.router.kill)
            await field.router.start()
            alpha = await stack.enter_async_context(field.station("Alpha"))
            bravo = await stack.enter_async_context(field.station("Bravo"))
            bravo.offer(flight)
            alpha.offer(bytes_per_s=50_000)
            await alpha.sees("Bravo")
            came: queue.SimpleQueue[str] = queue.SimpleQueue()
            with station_session(field, "Charlie") as charlie:
                for keys in ("hedgehop/recordings/**", f"{ROOT}/*/to/Alpha/**", meant_for("Charlie"), "**"):
                    charlie.declare_subscriber(
                        keys,
                        lambda sample: came.put(str(sample.key_expr)),
                        allowed_origin=zenoh.Locality.REMOTE,
                    )
                await alpha.asks(ListRecordings("Bravo"))
                sha256 = bytes.fromhex(await alpha.fetch("Bravo", "flight.mcap"))
                await alpha.fetches(lambda fetch: fetch.have_bytes > 20_000)
                # Bravo's words with Charlie's certificate: a piece of a wrong length would end the fetch.
                forged = msgspec.msgpack.encode(PieceGive(sha256, 0, b"forged"))
                for _ in range(20):
                    charlie.put(gives_key("Bravo", "Alpha"), forged)
                done = await alpha.fetches(lambda fetch: fetch.state in ("whole", "failed"))
                assert (done.state, done.text) == ("whole", "")
                # Under its own name it is heard, and is no fetch's station.
                bravo.offer(flight)
                charlie.put(asks_key("Charlie", "Bravo"), msgspec.msgpack.encode(ListAsk(0)))
                heard = {await asyncio.to_thread(came.get, timeout=PATIENCE_S)}
                while gives_key("Bravo", "Charlie") not in heard:
                    heard.add(await asyncio.to_thread(came.get, timeout=PATIENCE_S))
            assert {key for key in heard if key.startswith(ROOT)} == {gives_key("Bravo", "Charlie")}

    _in_folder(whole)


def test_with_a_router_file_of_before_it_is_said_and_positions_go_on() -> None:
    async def whole(folder: Path) -> None:
        field = Field(folder, ("Alpha", "Bravo"))
        file = field.files / ROUTER_FILE
        head, _, text = file.read_text().partition("\n")
        config = json.loads(text)
        control = config["access_control"]
        control["rules"] = [rule for rule in control["rules"] if ROOT not in rule["key_exprs"][0]]
        there = {rule["id"] for rule in control["rules"]}
        for policy in control["policies"]:
            policy["rules"] = [name for name in policy["rules"] if name in there]
        file.write_text(f"{head}\n{json.dumps(config)}")
        async with AsyncExitStack() as stack:
            stack.callback(field.router.kill)
            await field.router.start()
            alpha = await stack.enter_async_context(field.station("Alpha"))
            bravo = await stack.enter_async_context(field.station("Bravo"))
            bravo.offer()
            alpha.offer()
            await alpha.sees("Bravo")
            await alpha.asks(ListRecordings("Bravo"))
            silent = await alpha.lists("Bravo", lambda each: each.state == "silent")
            assert "the router's file: make that anew with hedgehop stations" in silent.text
            await alpha.sees("Bravo", vehicles=2)

    _in_folder(whole)


def test_over_a_bad_line_positions_do_not_wait_for_what_is_fetched() -> None:
    """``stations_fetch_bench`` in short: both ages are of one run, on a machine that others use, too."""
    with short_folder() as folder:
        result = run(lambda: measure_fetch(folder, vehicles=3, seconds=12.0, bad=Bad()), WHOLE_S)
    assert result.fetched_bytes_per_s > 1000.0
    assert result.line_bytes_per_s < 32_000.0 / 2
    assert np.median(result.while_s) < np.median(result.without_s) + 0.5


def _in_folder(whole: Callable[[Path], Awaitable[None]]) -> None:
    with short_folder() as folder:
        run(lambda: whole(folder), WHOLE_S)
