"""Commands on real sockets: written down before they are sent, refused in the vehicle's words, never in silence."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError, RecordingFullError, RefusedError
from telemetry.topics.messages import CommandRecord
from telemetry.topics.requests import Arm, Disarm, ReturnHome
from tests.telemetry.fake_vehicle import UdpVehicle, ack, radio
from tests.telemetry.link_bench import ME, Console, listening, until
from tests.telemetry.own_time import run


class Disk:
    """Takes the place of the audit log."""

    head, id = "h", "i"

    def check(self) -> str:
        return ""

    def __init__(self, vehicle: UdpVehicle | None = None) -> None:
        self.full = False
        self.vehicle = vehicle
        self.written: list[tuple[str, int]] = []
        self.results: list[tuple[str, str]] = []

    def write(self, record: CommandRecord) -> None:
        if record.result:
            self.results.append((record.words, record.result))
            return
        if self.full:
            raise RecordingFullError("No space is left.")
        commands = [m for m in self.vehicle.of("COMMAND_LONG") if m.command == 400] if self.vehicle else []
        self.written.append((record.words, len(commands)))


async def answering(vehicle: UdpVehicle, results: dict[int, int], words: bytes = b"") -> None:
    """Acknowledges commands as told, until it is cancelled."""
    answered = 0
    while True:
        for message in vehicle.heard[answered:]:
            if message.get_type() == "COMMAND_LONG" and message.command in results:
                vehicle.send(ack(message.command, results[message.command]))
                if words:
                    vehicle.send(mavlink.MAVLink_statustext_message(2, words))
        answered = len(vehicle.heard)
        await asyncio.sleep(0.01)


@contextlib.asynccontextmanager
async def commanded(results: dict[int, int], words: bytes = b"") -> AsyncIterator[tuple[Console, UdpVehicle, Disk]]:
    disk = Disk()
    async with listening(adopt=True, audit=disk) as (bench, port), radio(port) as vehicle:
        disk.vehicle = vehicle
        await bench.live()
        task = asyncio.create_task(answering(vehicle, results, words))
        try:
            yield bench, vehicle, disk
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)


def test_a_command_is_written_down_before_it_is_sent() -> None:
    async def whole() -> None:
        async with commanded({400: 0}) as (bench, vehicle, disk):
            await bench.handle(Arm(ME))
            assert disk.written == [("arm", 0)]
            assert [m.param1 for m in vehicle.of("COMMAND_LONG") if m.command == 400] == [1.0]
            assert bench.commands == ["arm"]

    run(whole)


@pytest.mark.fact("A34")
def test_a_refused_arming_carries_the_vehicles_words() -> None:
    async def whole() -> None:
        async with commanded({400: 4}, b"Arm: Compass not calibrated") as (bench, _, _):
            with pytest.raises(RefusedError, match="Compass not calibrated"):
                await bench.handle(Arm(ME))
            await until(lambda: "Arm: Compass not calibrated" in bench.texts)

    run(whole)


def test_a_full_disk_forbids_arming_but_never_the_way_home() -> None:
    async def whole() -> None:
        async with commanded({400: 0, 176: 0}) as (bench, vehicle, disk):
            disk.full = True
            with pytest.raises(RecordingFullError):
                await bench.handle(Arm(ME))
            assert not [m for m in vehicle.of("COMMAND_LONG") if m.command == 400]
            await bench.handle(ReturnHome(ME))
            assert [m.param2 for m in vehicle.of("COMMAND_LONG") if m.command == 176] == [6.0]
            assert "No space" in bench.flight.hint

    run(whole)


def test_what_came_of_each_command_is_written_down_too() -> None:
    async def whole() -> None:
        async with commanded({400: 4}, b"PreArm: Compass not healthy") as (bench, _, disk):
            with pytest.raises(RefusedError):
                await bench.handle(Arm(ME))
            await until(lambda: disk.results)
            ((words, result),) = disk.results
            assert words == "arm"
            assert result.startswith("not done: ")
            await until(lambda: (bench.status.audit_head, bench.status.audit_log) == ("h", "i"))

    run(whole)


def test_motors_are_not_stopped_in_the_air() -> None:
    async def whole() -> None:
        async with commanded({400: 0}) as (bench, vehicle, _):
            vehicle.send(mavlink.MAVLink_extended_sys_state_message(0, 2))
            await until(lambda: bench.state.landed == "in_air")
            with pytest.raises(NotAllowedError, match="in the air"):
                await bench.handle(Disarm(ME))
            vehicle.send(mavlink.MAVLink_extended_sys_state_message(0, 1))
            await until(lambda: bench.state.landed == "on_ground")
            await bench.handle(Disarm(ME))
            assert [m.param1 for m in vehicle.of("COMMAND_LONG") if m.command == 400] == [0.0]

    run(whole)
