"""Stations as processes around a router with TLS and access control: they see each other, and nobody is taken in."""

from __future__ import annotations

import asyncio
import queue
import signal
import time
from contextlib import AsyncExitStack, suppress
from pathlib import Path

import pytest
import zenoh

from server.door.certificates import CertificateFiles, Names, now_utc
from telemetry.stations.other import LOST_S
from telemetry.stations.station_messages import encode, vehicle_wire
from telemetry.stations.station_names import vehicle_key
from telemetry.topics.station_vehicles import FleetVehicle, StationsStatus
from tests.telemetry.bad_line import Bad
from tests.telemetry.bus_runs import PATIENCE_S, run, short_folder
from tests.telemetry.station_fleet import Field, line_of, station_session, true_age_s
from tests.telemetry.stations_bench import ROUND_S, measure

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]

NAMES = ("Alpha", "Bravo", "Charlie")
WHOLE_S = 4 * PATIENCE_S
"""Several processes, one after the other, each with its own patience."""


def test_three_stations_see_each_other_and_again_after_the_router_died() -> None:
    async def whole(folder: Path) -> None:
        field = Field(folder, NAMES)
        async with AsyncExitStack() as stack:
            stack.callback(field.router.kill)
            alpha, bravo, charlie = [await stack.enter_async_context(field.station(name)) for name in NAMES]
            # No router yet: said, and nothing else happens.
            await alpha.until(lambda status: "No router answers" in status.text)
            await field.router.start()
            seen = await alpha.sees("Bravo", "Charlie", vehicles=4)
            await bravo.sees("Alpha", "Charlie")
            await charlie.sees("Alpha", "Bravo")
            _ages_are_true(seen)
            assert seen.refused == 0
            # And the line of each: asked for, and sent whole.
            with_lines = await alpha.until(lambda status: len(status.lines) == 4)
            assert {(line.station, line.number): line.packed for line in with_lines.lines} == {
                (name, number): line_of(number) for name in ("Bravo", "Charlie") for number in (1, 2)
            }
            # The router dies: both others are lost at once, with words; it comes back, and so do they.
            field.router.kill()
            lost = await alpha.until(lambda status: all(station.state == "lost" for station in status.stations))
            assert all("is not heard since" in station.text for station in lost.stations)
            assert all(lost.t_mono_s - station.heard_t_mono_s >= LOST_S for station in lost.stations)
            away = await alpha.until(lambda status: status.router == "lost")
            assert "Own vehicles are not affected" in away.text
            assert len(away.vehicles) == 4
            await field.router.start()
            _ages_are_true(await alpha.sees("Bravo", "Charlie"))
            await charlie.sees("Alpha", "Bravo")
            # One of them ends: the other stays.
            bravo.node.send_signal(signal.SIGTERM)
            gone = await alpha.until(lambda status: [s.state for s in status.stations] == ["lost", "live"])
            assert gone.stations[0].name == "Bravo"
            assert await asyncio.to_thread(bravo.node.wait, PATIENCE_S) == 0

    _in_folder(whole)


def test_the_router_lets_nobody_speak_under_anothers_name() -> None:
    async def whole(folder: Path) -> None:
        field = Field(folder, NAMES)
        async with AsyncExitStack() as stack:
            stack.callback(field.router.kill)
            await field.router.start()
            alpha = await stack.enter_async_context(field.station("Alpha"))
            await stack.enter_async_context(field.station("Charlie"))
            await alpha.sees("Charlie")
            # Bravo's name with Alpha's certificate: it hears, and nobody hears it; it says so.
            impostor = await stack.enter_async_context(field.station("Bravo", shown="Alpha"))
            told = await impostor.until(
                lambda status: (
                    len(status.stations) == 2
                    and all("does not hear this station" in station.text for station in status.stations)
                )
            )
            assert not any(station.hears_us for station in told.stations)
            # By hand, with a whole message: Charlie's certificate, and Alpha's name, or another one's.
            with station_session(field, "Charlie") as session:
                forged = vehicle_wire(FleetVehicle(7, "Forged"), run=5, count=1, now_mono_s=1.0)
                for name in ("Alpha", "Bravo", "Delta"):
                    session.put(vehicle_key(name, 7), encode(forged))
                    session.delete(vehicle_key(name, 1))
                # Under its own name it is let through, and there it is refused as what it is.
                for payload in (b"", b"\xff" * 40, b"x" * 60_000):
                    before = alpha.statuses[-1].refused
                    # Not where Charlie itself speaks: of one name only the newest message counts.
                    session.put(vehicle_key("Charlie", 31), payload)
                    await alpha.until(lambda status, before=before: status.refused > before)
                before = alpha.statuses[-1].refused
                session.put("hedgehop/stations/1/Charlie/order/1", b"land")
                seen = await alpha.until(lambda status: status.refused > before)
            assert {station.name for station in seen.stations} == {"Charlie"}
            assert 7 not in {other.it.number for other in seen.vehicles}
            _ages_are_true(await alpha.sees("Charlie"))

    _in_folder(whole)


def test_no_command_and_no_question_gets_through_the_router_whoever_asks() -> None:
    """With a whole certificate, by hand: what another station's bus, or this one, would take for a request."""

    async def whole(folder: Path) -> None:
        field = Field(folder, NAMES)
        async with AsyncExitStack() as stack:
            stack.callback(field.router.kill)
            await field.router.start()
            heard, asked = await asyncio.to_thread(_ask_for_everything, field)
            assert heard == {"hedgehop/stations/1/Charlie/beacon"}
            assert asked == []

    _in_folder(whole)


_COMMANDS = (
    "hedgehop/stations/1/Bravo/order/1",
    "hedgehop/stations/1/Alpha/vehicle/1",
    "hedgehop/stations/2/Charlie/order",
    "hedgehop/stations/1",
    "hedgehop/link/arm",
    "link/request",
    "vehicle/state",
    "@/router/config",
)


def _said(sample: zenoh.Sample) -> str:
    return str(sample.key_expr) if sample.kind == zenoh.SampleKind.PUT else f"deleted: {sample.key_expr}"


def _ask_for_everything(field: Field) -> tuple[set[str], list[str]]:
    """Keys of what Bravo hears of Charlie, and what it is asked, once what Charlie may say has come for the third time:
    of one session nothing overtakes."""
    came: queue.SimpleQueue[str] = queue.SimpleQueue()
    asked, heard = list[str](), list[str]()
    may = "hedgehop/stations/1/Charlie/beacon"
    with station_session(field, "Bravo") as bravo, station_session(field, "Charlie") as charlie:
        for keys in ("hedgehop/stations/1/**", "**", "vehicle/**", "link/**"):
            bravo.declare_subscriber(keys, lambda sample: came.put(_said(sample)))
            bravo.declare_queryable(keys, lambda query: asked.append(str(query.key_expr)))
        bravo.liveliness().declare_subscriber("**", lambda sample: came.put(f"alive: {sample.key_expr}"))
        end_s = time.monotonic() + PATIENCE_S
        while heard.count(may) < 3:
            assert time.monotonic() < end_s, heard
            for key in _COMMANDS:
                charlie.put(key, b"land")
                charlie.delete(key)
                assert [reply for reply in charlie.get(key, timeout=0.2) if reply.ok is not None] == []
            charlie.delete(may)
            charlie.liveliness().declare_token("hedgehop/stations/1/Charlie/alive")
            charlie.put(may, b"whatever")
            with suppress(queue.Empty):
                while True:
                    heard.append(came.get(timeout=0.5))
    return set(heard), asked


def test_without_a_certificate_of_the_authority_nobody_comes_in() -> None:
    async def whole(folder: Path) -> None:
        field, others = Field(folder, NAMES), Field(folder / "others", NAMES)
        async with AsyncExitStack() as stack:
            stack.callback(field.router.kill)
            await field.router.start()
            alpha = await stack.enter_async_context(field.station("Alpha"))
            await alpha.until(lambda status: status.router == "connected")
            its_own = (field.files / "Bravo.pem").read_bytes()
            (field.files / "Bravo.pem").write_bytes((others.files / "Bravo.pem").read_bytes())
            bravo = await stack.enter_async_context(field.station("Bravo"))
            await bravo.until(lambda status: "is of another authority than this station's file" in status.text)
            # The console's certificate is of the same authority, and shows no station.
            CertificateFiles(folder / "data").renew(now_utc(), Names(frozenset({"localhost"}), frozenset()))
            (field.files / "Charlie.pem").write_bytes((folder / "data" / "tls" / "console.pem").read_bytes())
            charlie = await stack.enter_async_context(field.station("Charlie"))
            await charlie.until(lambda status: "refuses this station's certificate" in status.text)
            assert alpha.statuses[-1].stations == ()
            # With a file of its own at last it comes in, without being started again.
            (field.files / "Bravo.pem").write_bytes(its_own)
            await alpha.sees("Bravo")
            # And a file that is replaced while it is connected is taken up, for the day on which the old one ends.
            begun = (await bravo.until(lambda status: status.router == "connected")).listens_since_t_mono_s
            (field.files / "Bravo.pem").write_bytes(its_own)
            again = await bravo.until(lambda status: status.listens_since_t_mono_s not in (None, begun))
            assert again.router == "connected"

    _in_folder(whole)


def test_over_bad_lines_no_age_is_told_too_young_and_a_vehicle_stays_within_its_budget() -> None:
    """``stations_bench`` in short."""
    with short_folder() as folder:
        result = run(lambda: measure(folder, stations=2, vehicles=3, seconds=5.0, bad=Bad()), WHOLE_S)
    assert len(result.ages_s)
    assert (result.told_s >= result.ages_s - ROUND_S).all()
    assert 0.0 < max(result.up_bytes_per_s, result.down_bytes_per_s) < 2000.0
    assert (result.mixed_up, result.refused) == (0, 0)


def _ages_are_true(status: StationsStatus) -> None:
    """At the worse end of what is told, and no worse than a loaded machine makes it."""
    for other in status.vehicles:
        assert other.oldest_t_mono_s is not None
        oldest_s = status.t_mono_s - other.oldest_t_mono_s
        true_s = true_age_s(other, status.t_mono_s)
        assert oldest_s - other.unsure_s - ROUND_S <= true_s <= oldest_s + ROUND_S


def _in_folder(whole: object) -> None:
    with short_folder() as folder:
        run(lambda: whole(folder), WHOLE_S)  # type: ignore[operator]
