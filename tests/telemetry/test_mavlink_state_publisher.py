"""The vehicle's state on its way out: positions at once, the rest in time, never too often."""

import asyncio
from dataclasses import replace

from telemetry.link.publishing import PERIOD_S, StatePublisher
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.link_bench import until
from tests.telemetry.own_time import run

FIRST = VehicleState(1, 1, position_t_mono_s=1.0)


def test_the_first_does_not_wait() -> None:
    async def whole() -> None:
        out: list[VehicleState] = []
        StatePublisher(out.append).offer(FIRST)
        assert out == [FIRST]

    run(whole)


def test_many_become_few_and_the_latest_wins() -> None:
    async def whole() -> None:
        out: list[VehicleState] = []
        publisher = StatePublisher(out.append)
        loop = asyncio.get_running_loop()
        begin_s = loop.time()
        state = FIRST
        for k in range(300):
            state = replace(FIRST, roll_rad=float(k), position_t_mono_s=float(k))
            publisher.offer(state)
            await asyncio.sleep(0.001)
        await until(lambda: out[-1] == state)
        assert len(out) <= 2 + (loop.time() - begin_s) / 0.04

    run(whole)


def test_a_position_goes_before_the_others_turn() -> None:
    async def whole() -> None:
        out: list[VehicleState] = []
        publisher = StatePublisher(out.append)
        publisher.offer(FIRST)
        rolled = replace(FIRST, roll_rad=0.5)
        publisher.offer(rolled)
        assert out == [FIRST]
        await asyncio.sleep(PERIOD_S)
        await until(lambda: out[-1] == rolled)
        await asyncio.sleep(PERIOD_S)
        moved = replace(rolled, position_t_mono_s=2.0)
        publisher.offer(moved)
        assert out[-1] == moved

    run(whole)


def test_nothing_comes_after_the_end() -> None:
    async def whole() -> None:
        out: list[VehicleState] = []
        publisher = StatePublisher(out.append)
        publisher.offer(FIRST)
        publisher.offer(replace(FIRST, roll_rad=0.5))
        publisher.close()
        await asyncio.sleep(2 * PERIOD_S)
        assert out == [FIRST]

    run(whole)
