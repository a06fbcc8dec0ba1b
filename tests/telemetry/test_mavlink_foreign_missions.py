"""Another ground station writes a mission when one is being started or flown: it is not flown unseen."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from pymavlink import mavutil

from telemetry.errors import MissionUnknownError
from telemetry.simulation.simulator.run import Simulator
from telemetry.topics.messages import VehicleText
from telemetry.topics.onboard_lists import Item
from telemetry.topics.requests import Resume, ReturnHome, StartAuto
from tests.telemetry.link_bench import ME, Console, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_flights import items, phase, simulated, start, upload

PATIENCE_S = 20


class Stranger:
    """pymavlink on a connection of its own. Its methods block: for a thread."""

    def __init__(self, simulator: Simulator) -> None:
        address = simulator.address.replace("tcpin", "tcp")
        self._link: Any = mavutil.mavlink_connection(address, source_system=254, source_component=190)
        self._link.wait_heartbeat(timeout=PATIENCE_S)

    def write(self, mission: tuple[Item, ...]) -> int:
        """MAV_MISSION_RESULT of the whole transfer."""
        rows = (Item(16, 0, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0), *mission)
        self._link.mav.mission_count_send(1, 1, len(rows), 0)
        while True:
            message = self._link.recv_match(type=["MISSION_REQUEST", "MISSION_ACK"], blocking=True, timeout=PATIENCE_S)
            assert message is not None
            if message.get_type() == "MISSION_ACK":
                return message.type
            row = rows[message.seq]
            lat_e7, lon_e7 = round(row.lat_deg * 1e7), round(row.lon_deg * 1e7)
            self._link.mav.mission_item_int_send(
                1, 1, message.seq, row.frame, row.command, 0, 1, *row.params, lat_e7, lon_e7, row.alt_m, 0
            )

    def close(self) -> None:
        self._link.close()


def elsewhere(count: int) -> tuple[Item, ...]:
    """Another mission with as many items."""
    first, *rest = items(count - 2)
    return (first, *(Item(i.command, i.frame, i.params, i.lat_deg, i.lon_deg, i.alt_m + 30.0) for i in rest))


async def alone(bench: Console, mission: tuple[Item, ...]) -> str:
    report = await upload(bench, mission)
    await until(lambda: bench.status.mission_state == "verified")
    return report.onboard.digest


async def refused_after(count: int, after_s: float) -> None:
    async with simulated(speedup=1.0) as (bench, simulator):
        stranger = await asyncio.to_thread(Stranger, simulator)  # before: it waits for a heartbeat, in real time
        digest = await alone(bench, items(3))
        assert await asyncio.to_thread(stranger.write, elsewhere(count)) == 0
        await asyncio.sleep(after_s)
        assert bench.status.mission_digest == digest
        with pytest.raises(MissionUnknownError):
            await bench.handle(StartAuto(ME, digest))
        await until(lambda: not simulator.vehicle.autopilot.armed)
        assert simulator.vehicle.autopilot.mode.name != "AUTO"
        await phase(bench, "idle")
        stranger.close()


@pytest.mark.fact("A29")
@pytest.mark.parametrize("count", [5, 7])
def test_a_start_right_after_a_foreign_write_is_refused(count: int) -> None:
    """At any moment between two looks of the link at what is on board, on as many vehicles at once."""
    run(lambda: asyncio.gather(*(refused_after(count, after_s) for after_s in (0.0, 0.02, 0.05, 0.09))))


@pytest.mark.fact("A29")
def test_a_foreign_write_during_the_start_is_never_flown_away_with() -> None:
    async def whole() -> None:
        async with simulated(speedup=1.0) as (bench, simulator):
            digest = await alone(bench, items(3))
            stranger = await asyncio.to_thread(Stranger, simulator)
            starting = asyncio.create_task(bench.handle(StartAuto(ME, digest)))
            assert await asyncio.to_thread(stranger.write, elsewhere(5)) == 0
            await asyncio.gather(starting, return_exceptions=True)
            await until(lambda: simulator.vehicle.autopilot.mode.name != "AUTO")
            assert simulator.vehicle.truth.p_neu[2] < 2.0
            stranger.close()

    run(whole)


@pytest.mark.fact("A31")
@pytest.mark.parametrize("count", [5, 8])
def test_in_flight_it_is_an_alarm_and_a_hold(count: int) -> None:
    async def whole() -> None:
        async with simulated(speedup=3.0) as (bench, simulator):
            digest = await alone(bench, items(3))
            await start(bench, StartAuto(ME, digest))
            await phase(bench, "flying")
            stranger = await asyncio.to_thread(Stranger, simulator)
            assert await asyncio.to_thread(stranger.write, elsewhere(count)) == 0
            await until(lambda: bench.state.mode == "BRAKE", 5.0)
            await phase(bench, "paused")
            alarms = [text for text in bench.of(VehicleText) if text.severity <= 1]
            assert ["another ground station has written" in text.text for text in alarms] == [True]
            await until(lambda: "another ground station" in bench.flight.hint)
            assert any(words.startswith("hold: The mission on board") for words in bench.commands)
            with pytest.raises(MissionUnknownError):
                await bench.handle(Resume(ME))
            await bench.handle(ReturnHome(ME))
            await phase(bench, "returning")
            stranger.close()

    run(whole)
