"""The start of a mission on board while its link loses messages: sent off in time, or why not."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from planning.basics.mav_cmd import MavCmd
from telemetry.errors import SilentError
from telemetry.simulation.simulator.protocol.mavlink import Endpoint
from telemetry.topics.requests import StartAuto
from tests.telemetry.link_bench import ME, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_flights import phase, simulated, upload

SLOW_S = 2.5


def test_a_start_order_that_is_lost_is_given_again_before_the_motors_are_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """The vehicle waits 10 s from arming on: with the order lost twice there were more than 12 before the third."""

    async def whole() -> None:
        async with simulated(speedup=1.0) as (bench, simulator):
            report = await upload(bench)
            received, lost = Endpoint.on_message, []

            def lossy(endpoint: Endpoint, message: Any, *rest: Any) -> Any:
                is_start = message.get_type() == "COMMAND_LONG" and message.command == MavCmd.MISSION_START
                if is_start and len(lost) < 2:
                    lost.append(message)
                    return []
                return received(endpoint, message, *rest)

            monkeypatch.setattr(Endpoint, "on_message", lossy)
            await bench.handle(StartAuto(ME, report.onboard.digest))
            assert len(lost) == 2
            await until(lambda: simulator.vehicle.truth.p_neu[2] > 2.0)

    run(whole)


def test_motors_that_are_off_again_are_said_and_not_switched_on_a_second_time() -> None:
    async def whole() -> None:
        async with simulated(speedup=1.0, parameters=(("DISARM_DELAY", 1.0),)) as (bench, simulator):
            report = await upload(bench)
            assert bench.pilot is not None
            read_mission = bench.pilot._read_mission

            async def slowly() -> Any:
                await asyncio.sleep(SLOW_S)
                return await read_mission()

            bench.pilot._read_mission = slowly
            with pytest.raises(SilentError, match="motors are off again") as caught:
                await bench.handle(StartAuto(ME, report.onboard.digest))
            assert "DISARM_DELAY" in caught.value.advice
            await phase(bench, "idle")
            assert bench.texts.count("Arming motors") == 1
            assert not simulator.vehicle.autopilot.armed

    run(whole)
