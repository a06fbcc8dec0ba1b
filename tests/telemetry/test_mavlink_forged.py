"""Packets with the vehicle's own address, and its numbers from another port, on real sockets."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError
from telemetry.topics.requests import Adopt, Arm, Connect, Resume, ReturnHome, Upload
from telemetry.topics.vehicle import VehicleState
from tests.free_ports import free_port
from tests.telemetry.fake_vehicle import UdpVehicle, ack
from tests.telemetry.frames import packed
from tests.telemetry.link_bench import ME, Console, console, until
from tests.telemetry.own_time import run

AUTO, RTL, LOITER = 3, 6, 5
ON_GROUND, IN_AIR = 1, 2
UPLOAD = Upload(ME, (), 47.0, 8.0, 500.0)


def status(*, armed: bool, mode: int = AUTO) -> Any:
    return mavlink.MAVLink_heartbeat_message(2, 3, 1 | (128 if armed else 0), mode, 4, 3)


def landed(number: int) -> Any:
    return mavlink.MAVLink_extended_sys_state_message(0, number)


def place(boot_ms: int, lat: int = 470_000_000) -> Any:
    return mavlink.MAVLink_global_position_int_message(boot_ms, lat, 80_000_000, 530_000, 30_000, 500, 0, 0, 0)


class Flying:
    """A vehicle in AUTO, 30 m above home, as a real one speaks."""

    def __init__(self, vehicle: UdpVehicle) -> None:
        self.vehicle, self.mode, self.boot_ms = vehicle, AUTO, 60_000

    async def speak(self) -> None:
        for tick in range(10**9):
            self.boot_ms += 50
            self.vehicle.send(place(self.boot_ms))
            if tick % 5 == 0:
                self.vehicle.send(landed(IN_AIR))
            if tick % 20 == 0:
                self.vehicle.send(status(armed=True, mode=self.mode))
                self.vehicle.send(mavlink.MAVLink_mission_current_message(2, 5))
            self._obey()
            await asyncio.sleep(0.05)

    def _obey(self) -> None:
        for message in self.vehicle.heard:
            if message.get_type() == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_DO_SET_MODE:
                self.mode = int(message.param2)
                self.vehicle.send(ack(message.command, 0), status(armed=True, mode=self.mode))
        self.vehicle.heard.clear()


@contextlib.asynccontextmanager
async def speaking(vehicle: UdpVehicle, say: Callable[[], Any]) -> AsyncIterator[None]:
    task = asyncio.create_task(say())
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        vehicle.close()


@contextlib.asynccontextmanager
async def in_flight() -> AsyncIterator[tuple[Console, Flying, int]]:
    port = free_port()
    async with console() as bench:
        await bench.handle(Connect(ME, f"udpin:127.0.0.1:{port}", True))
        flying = Flying(UdpVehicle(port))
        async with speaking(flying.vehicle, flying.speak):
            await until(lambda: bench.flight.phase == "flying" and bench.state.landed == "in_air")
            yield bench, flying, port


@pytest.mark.fact("A32")
def test_what_is_forged_in_the_vehicles_name_neither_lands_nor_moves_nor_forgets_it() -> None:
    async def body() -> None:
        async with in_flight() as (bench, flying, _):
            before = len(bench.published)
            for _ in range(60):
                flying.vehicle.send_bytes(packed(status(armed=False)))
                flying.vehicle.send_bytes(packed(landed(ON_GROUND)))
                flying.vehicle.send_bytes(packed(place(flying.boot_ms, 470_500_000)))
                flying.vehicle.send_bytes(packed(place(100)))
                await asyncio.sleep(0.05)
                assert bench.flight.phase == "flying"
                with pytest.raises(NotAllowedError, match="A mission is being flown"):
                    await bench.handle(UPLOAD)
            states = [one for _, one in bench.published[before:] if isinstance(one, VehicleState)]
            assert len(states) > 20
            assert all(one.armed and one.landed == "in_air" for one in states)
            assert all(one.lat_deg == pytest.approx(47.0) for one in states)
            assert any("Somebody else may be sending as this vehicle" in each for each in bench.status.warnings)
            flying.mode = LOITER
            await until(lambda: bench.flight.phase == "paused")
            resuming = asyncio.create_task(bench.handle(Resume(ME)))
            await asyncio.sleep(0.3)
            assert not (resuming.done() and isinstance(resuming.exception(), NotAllowedError))
            resuming.cancel()
            await asyncio.gather(resuming, return_exceptions=True)

    run(body)


def test_one_forged_packet_is_told_and_changes_nothing() -> None:
    async def body() -> None:
        async with in_flight() as (bench, flying, _):
            flying.vehicle.send_bytes(packed(status(armed=False)))
            await until(lambda: any("disarmed in the air" in each for each in bench.texts))
            await until(lambda: any("Somebody else" in each for each in bench.status.warnings))
            assert bench.state.armed
            assert bench.flight.phase == "flying"

    run(body)


def test_its_numbers_from_another_port_are_nobody_until_the_operator_says_so() -> None:
    async def body() -> None:
        async with in_flight() as (bench, flying, port):
            link, since = bench.link, bench.flight.since_utc_s
            other = Flying(UdpVehicle(port))
            flying.vehicle.send = lambda *_: None  # type: ignore[method-assign]
            heard: list[Any] = []
            other._obey = lambda: heard.extend(other.vehicle.heard) or other.vehicle.heard.clear()  # type: ignore
            async with speaking(other.vehicle, other.speak):
                await until(lambda: bench.status.again is not None)
                with pytest.raises(Exception, match="is lost"):
                    await bench.handle(Arm(ME))
                await asyncio.sleep(0.5)
                assert heard == []
                assert bench.flight.phase == "flying"
                again = bench.status.again
                assert again is not None
                assert again.peer == f"127.0.0.1:{other.vehicle.port}"
                del other._obey
                session = link.session
                await bench.handle(Adopt(ME, again.id))
                assert link.session is session
                await bench.live()
                await bench.handle(ReturnHome(ME))
                assert other.mode == RTL
                assert bench.flight.since_utc_s == since
                assert bench.status.again is None

    run(body)
