"""One vehicle over several ways at once, on real sockets: change over in flight, back again, and never two orders."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import AsyncIterator
from typing import Any, cast

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError
from telemetry.link.ways.choosing import SETTLE_S
from telemetry.simulation.simulator.autopilot.flight_modes import Hold
from telemetry.simulation.simulator.run import SimOptions, Simulator, flying
from telemetry.topics.link_ways import WayStatus
from telemetry.topics.messages import RawFrame
from telemetry.topics.requests import Adopt, Arm, Connect, Disarm, Disconnect, Pause, Resume, SetSigning, StartAuto
from telemetry.traffic.traffic_picture import EVERY_S
from tests.telemetry.link_bench import ME, Console, console, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_flights import ALT_M, LAT_DEG, LON_DEG, items, phase, start, upload
from tests.telemetry.traffic_messages import adsb_message, over_the_air
from tests.telemetry.udp_faults import Proxy, lossy_udp, routed_udp

OF_EVERY_WAY = {mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_TIMESYNC}
FAILSAFE = (("FS_GCS_ENABLE", 1.0), ("FS_GCS_TIMEOUT", 3.0))


class Obeying:
    """What of the vehicle's orders arrived there, and from whom."""

    def __init__(self, simulator: Simulator) -> None:
        self.orders: list[tuple[Any, int, int]] = []
        """Peer, command, confirmation."""
        self._on_message = simulator.endpoint.on_message
        cast(Any, simulator.endpoint).on_message = self._look

    def _look(self, message: Any, peer: Any, now_s: float) -> Any:
        if message.get_type() == "COMMAND_LONG":
            self.orders.append((peer, message.command, message.confirmation))
        return self._on_message(message, peer, now_s)

    def counted(self) -> Counter[int]:
        return Counter(command for _, command, _ in self.orders)


@contextlib.asynccontextmanager
async def vehicle(**options: Any) -> AsyncIterator[tuple[Simulator, int]]:
    wanted: dict[str, Any] = {"link": "udpin:127.0.0.1:0", "boot_s": 0.5, "speedup": 2.0, "parameters": FAILSAFE}
    async with flying(SimOptions(LAT_DEG, LON_DEG, ALT_M, **(wanted | options))) as simulator:
        yield simulator, int(simulator.address.rpartition(":")[2])


def at(proxy: Proxy) -> str:
    return f"udpout:127.0.0.1:{proxy.port}"


def way(bench: Console, address: str) -> WayStatus | None:
    return next((each for each in bench.status.ways if each.address == address), None)


def identity(bench: Console, address: str) -> str | None:
    found = way(bench, address)
    return None if found is None else found.identity


def used(bench: Console) -> str:
    return next(each.address for each in bench.status.ways if each.in_use)


async def reached(bench: Console, *addresses: str) -> None:
    """Over all of them, the first one in use."""
    for address in addresses:
        await bench.handle(Connect(ME, address, adopt=address == addresses[0], as_way=True))
        await bench.live()
    await until(lambda: {each.address for each in bench.status.ways if each.identity == "known"} == set(addresses))


@contextlib.asynccontextmanager
async def two_ways(*, delay_s: float = 0.0, **options: Any) -> AsyncIterator[tuple[Simulator, Proxy, Proxy, Console]]:
    """A vehicle that is heard over one way, which is in use, and over another one, as much later."""
    async with (
        vehicle(**options) as (simulator, port),
        lossy_udp(port, loss=0.0) as one,
        lossy_udp(port, loss=0.0, delay_s=delay_s) as other,
        console() as bench,
    ):
        await reached(bench, at(one), at(other))
        yield simulator, one, other, bench


def sent_frames(bench: Console, *, spare: bool) -> list[bytes]:
    frames = [message for _, message in bench.published if isinstance(message, RawFrame)]
    return [raw.frame for raw in frames if raw.sent and raw.spare is spare]


def message_id(frame: bytes) -> int:
    return int.from_bytes(frame[7:10], "little")


def test_when_the_way_in_use_falls_silent_in_flight_another_takes_over_and_gives_it_back() -> None:
    async def whole() -> None:
        async with (
            vehicle() as (simulator, port),
            lossy_udp(port, loss=0.0, delay_s=0.02) as good,
            lossy_udp(port, loss=0.3, delay_s=0.1, seed=3) as bad,
            console() as bench,
        ):
            obeyed = Obeying(simulator)
            await reached(bench, at(good), at(bad))
            report = await upload(bench, items(40))
            await start(bench, StartAuto(ME, report.onboard.digest))
            await phase(bench, "flying")
            assert used(bench) == at(good)
            worse = way(bench, at(bad))
            assert worse is not None
            assert worse.quality is not None
            assert worse.round_trip_s is not None
            assert worse.quality < 0.95
            assert worse.round_trip_s >= 0.2
            good.is_cut, cut_s, before = True, time.monotonic(), len(obeyed.orders)
            await until(lambda: used(bench) == at(bad))
            assert time.monotonic() - cut_s < 2.5
            assert any("silent for" in text and at(bad) in text for text in bench.texts)
            await bench.handle(Pause(ME))
            await until(lambda: isinstance(simulator.vehicle.autopilot.mode, Hold), 10.0)
            assert {peer for peer, *_ in obeyed.orders[before:]} == {bad.far_address}
            assert bench.status.state == "live"
            good.is_cut, back_s = False, time.monotonic()
            await until(lambda: used(bench) == at(good), 30.0)
            assert time.monotonic() - back_s >= SETTLE_S
            await bench.handle(Resume(ME))
            await phase(bench, "flying")
            assert not any("GCS Failsafe" in text for text in bench.texts)
            assert any(words.startswith("Link: now over") for words in bench.commands)
            assert {message_id(frame) for frame in sent_frames(bench, spare=True)} == OF_EVERY_WAY
            commands = [frame for frame in sent_frames(bench, spare=False) if message_id(frame) == 76]
            decoder: Any = mavlink.MAVLink(None)
            sent = Counter(decoder.decode(bytearray(frame)).command for frame in commands)
            assert all(count <= sent[command] for command, count in obeyed.counted().items())

    run(whole)


def test_a_pause_is_obeyed_within_a_second_of_the_change_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "sleep", lambda seconds: pytest.fail(f"it blocks for {seconds} s"))

    async def whole() -> None:
        async with two_ways(delay_s=0.1) as (simulator, one, other, bench):
            report = await upload(bench, items(40))
            await start(bench, StartAuto(ME, report.onboard.digest))
            await phase(bench, "flying")
            one.is_cut = True
            await until(lambda: used(bench) == at(other), 2.0)
            asked_s = time.monotonic()
            await bench.handle(Pause(ME))
            assert isinstance(simulator.vehicle.autopilot.mode, Hold)
            assert time.monotonic() - asked_s < 1.0
            await bench.handle(Disconnect(ME, at(one)))
            assert [each.address for each in bench.status.ways] == [at(other)]
            await bench.handle(Resume(ME))
            await phase(bench, "flying")

    run(whole)


def test_a_way_over_which_nothing_reaches_the_vehicle_is_left_though_it_is_heard() -> None:
    async def whole() -> None:
        async with two_ways(delay_s=0.1, speedup=1.0) as (simulator, one, other, bench):
            obeyed = Obeying(simulator)
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            one.is_deaf, before = True, len(obeyed.orders)
            await until(lambda: used(bench) == at(other), 10.0)
            assert any("unanswered" in text for text in bench.texts)
            deaf = way(bench, at(one))
            assert deaf is not None
            assert (deaf.round_trip_s, deaf.quality) == (None, 1.0)
            assert deaf.silent_s is not None
            assert deaf.silent_s < 1.0
            await bench.handle(Arm(ME))
            assert {peer for peer, *_ in obeyed.orders[before:]} == {other.far_address}

    run(whole)


def test_the_way_in_use_can_be_taken_away_and_a_new_one_added_and_the_last_one_releases() -> None:
    async def whole() -> None:
        async with two_ways(speedup=1.0) as (_, one, other, bench):
            await bench.handle(Disconnect(ME, at(one)))
            there = bench.status.adopted
            assert there is not None
            assert (used(bench), there.address, bench.status.state) == (at(other), at(other), "live")
            await bench.handle(Connect(ME, at(one), as_way=True))
            await until(lambda: [each.identity for each in bench.status.ways] == ["known", "known"])
            assert used(bench) == at(other)
            await bench.handle(Disconnect(ME, at(one)))
            assert bench.status.adopted == there
            await bench.handle(Disconnect(ME, at(other)))
            assert (bench.status.adopted, bench.status.ways) == (None, ())

    run(whole)


def test_the_last_way_over_which_a_vehicle_is_heard_stays_while_it_may_fly_and_it_is_found_again_where_it_was() -> None:
    async def whole() -> None:
        async with two_ways(speedup=1.0) as (_, one, other, bench):
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            await bench.handle(Arm(ME))
            await until(lambda: bench.state.armed)
            other.is_cut = True
            await until(lambda: identity(bench, at(other)) == "asked", 10.0)
            with pytest.raises(NotAllowedError, match="the other ways are silent"):
                await bench.handle(Disconnect(ME, at(one)))
            assert (used(bench), bench.status.state) == (at(one), "live")
            other.is_cut = False
            await until(lambda: identity(bench, at(other)) == "known", 10.0)
            await bench.handle(Disconnect(ME, at(one)))
            other.is_cut = True
            await until(lambda: bench.status.state == "lost", 10.0)
            await bench.handle(Connect(ME, at(one), as_way=True))
            await until(lambda: bench.status.again is not None)
            assert bench.status.again is not None
            await bench.handle(Adopt(ME, bench.status.again.id))
            await until(lambda: (used(bench), bench.status.state) == (at(one), "live"))

    run(whole)


def test_aircraft_that_a_receiver_on_a_spare_way_hears_are_traffic_as_well() -> None:
    async def whole() -> None:
        async with two_ways(speedup=1.0) as (_, one, other, bench):
            session = bench.link.session
            assert session is not None
            now_s = time.monotonic()
            for number, address in enumerate((at(one), at(other), "udpin:127.0.0.1:1"), start=1):
                aircraft = over_the_air(adsb_message(ICAO_address=number), system=200)
                session.on_stranger(aircraft, now_s, address)
            told = session.traffic.on_tick(session.vehicle.state, now_s + EVERY_S, time.time())
            assert told is not None
            assert told.status.heard == 2

    run(whole)


async def told_on_the_ground(bench: Console, *addresses: str) -> tuple[list[str], tuple[Any, ...]]:
    """Words and state after an upload, arming and disarming, over as many ways."""
    await reached(bench, *addresses)
    await upload(bench)
    await bench.handle(Arm(ME))
    await until(lambda: bench.state.armed)
    await bench.handle(Disarm(ME))
    await until(lambda: not bench.state.armed and any("Disarming" in text for text in bench.texts))
    await until(lambda: bench.state.mission_items is not None)
    state = bench.state
    same = (state.mode, state.armed, state.mission_items, state.home_lat_deg, state.autopilot, state.landed)
    return [text for text in bench.texts if "rm" in text], same


def test_over_two_ways_words_and_state_are_those_of_one() -> None:
    async def over_channels(*losses: float) -> tuple[list[str], tuple[Any, ...]]:
        async with vehicle(speedup=1.0, gnss="perfect") as (_, port), contextlib.AsyncExitStack() as stack:
            proxies = [await stack.enter_async_context(lossy_udp(port, loss=loss, seed=5)) for loss in losses]
            return await told_on_the_ground(await stack.enter_async_context(console()), *map(at, proxies))

    async def over_a_router(ends: int) -> tuple[list[str], tuple[Any, ...]]:
        async with (
            vehicle(speedup=1.0, gnss="perfect") as (_, port),
            routed_udp(port, ends) as ports,
            console() as bench,
        ):
            return await told_on_the_ground(bench, *(f"udpout:127.0.0.1:{each}" for each in ports))

    async def whole() -> None:
        one = await over_channels(0.0)
        assert await over_channels(0.0, 0.2) == one
        assert await over_a_router(2) == one

    run(whole)


def test_a_vehicle_that_signs_is_reached_over_both_and_nothing_counts_as_a_replay() -> None:
    async def whole() -> None:
        async with two_ways(delay_s=0.2, speedup=1.0) as (_, one, other, bench):
            await bench.handle(SetSigning(ME, enabled=True))
            signed = len(bench.frames(sent=False))
            await until(lambda: len(bench.frames(sent=False)) > signed + 200)
            signing = bench.status.signing
            assert (signing.mode, signing.replayed, signing.wrong, signing.ahead) == ("on", 0, 0, 0)
            one.is_cut = True
            await until(lambda: used(bench) == at(other), 3.0)
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            await bench.handle(Arm(ME))
            await until(lambda: bench.state.armed)

    run(whole)


def test_another_vehicle_with_the_same_number_is_no_way() -> None:
    async def whole() -> None:
        async with vehicle(speedup=1.0) as (_, port), vehicle(speedup=1.0, boot_s=0.4) as (twin, twin_port):
            twin.vehicle.advance(30.0)
            obeyed = Obeying(twin)
            async with console() as bench:
                own, foreign = f"udpout:127.0.0.1:{port}", f"udpout:127.0.0.1:{twin_port}"
                await bench.handle(Connect(ME, own, adopt=True, as_way=True))
                await bench.live()
                await bench.handle(Connect(ME, foreign, as_way=True))
                await until(lambda: way(bench, foreign) is not None)
                await until(lambda: way(bench, foreign) is None)
                await until(lambda: any("second vehicle" in warning for warning in bench.status.warnings))
                assert (used(bench), obeyed.orders) == (own, [])
                assert [candidate.address for candidate in bench.status.candidates] == [foreign]

    run(whole)


def test_a_connection_that_is_not_named_as_a_way_never_becomes_one() -> None:
    async def whole() -> None:
        async with vehicle(speedup=1.0) as (_, port), console() as bench, lossy_udp(port, loss=0.0) as other:
            await bench.handle(Connect(ME, f"udpout:127.0.0.1:{port}", adopt=True))
            await bench.live()
            await bench.handle(Connect(ME, at(other)))
            await until(lambda: any("second vehicle" in warning for warning in bench.status.warnings))
            assert len(bench.status.ways) == 1

    run(whole)
