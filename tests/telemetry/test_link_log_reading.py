"""The link's reading of logs: refused in flight, one at a time, and out of the way of what a flight needs."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from telemetry.errors import NotAllowedError, TransferError
from telemetry.link.exchanges import Exchanges
from telemetry.link.log_reading import LogReading
from telemetry.topics.requests import Operator, ReadVehicleLog
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import MOST_BYTES

DISARMED = VehicleState(1, 1, heartbeat_t_mono_s=1.0)


def bench(state: VehicleState = DISARMED) -> tuple[LogReading, list[str]]:
    sent: list[str] = []
    exchanges = Exchanges(lambda message: sent.append(message.get_type()), lambda: 0.0)
    vehicle = SimpleNamespace(target=(1, 1), exchanges=exchanges, state=state)
    return LogReading(cast(Any, vehicle)), sent


def asked(size: int = 900) -> ReadVehicleLog:
    return ReadVehicleLog(Operator("anna", 1), 1, 0, size, is_last=True)


@pytest.mark.parametrize("state", [replace(DISARMED, armed=True), replace(DISARMED, heartbeat_t_mono_s=None)])
def test_nothing_is_asked_of_a_vehicle_that_may_be_armed(state: VehicleState) -> None:
    async def run() -> None:
        logs, sent = bench(state)
        for reading in (logs.list(), logs.read(asked())):
            with pytest.raises(NotAllowedError, match="armed"):
                await reading
        assert sent == []

    asyncio.run(run())


@pytest.mark.parametrize("size", [0, -1, MOST_BYTES + 1])
def test_no_more_is_read_at_once_than_can_be_ended_soon(size: int) -> None:
    async def run() -> None:
        with pytest.raises(NotAllowedError, match="at once"):
            await bench()[0].read(asked(size))

    asyncio.run(run())


def test_a_mission_that_is_transferred_goes_before() -> None:
    async def run() -> None:
        logs, sent = bench()
        reading = asyncio.create_task(logs.read(asked()))
        await asyncio.sleep(0)
        logs.give_way()
        with pytest.raises(TransferError, match="a mission is being transferred"):
            await reading
        assert sent == ["LOG_REQUEST_DATA", "LOG_REQUEST_END"]
        logs.give_way()

    asyncio.run(run())


def test_a_second_one_waits_for_the_first() -> None:
    async def run() -> None:
        logs, sent = bench()
        first = asyncio.create_task(logs.read(asked()))
        second = asyncio.create_task(logs.list())
        await asyncio.sleep(0)
        assert sent == ["LOG_REQUEST_DATA"]
        first.cancel()
        for _ in range(5):
            await asyncio.sleep(0)
        assert sent[-1] == "LOG_REQUEST_LIST"
        second.cancel()

    asyncio.run(run())
