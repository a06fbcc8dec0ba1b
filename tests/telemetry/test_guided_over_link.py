"""Guided ways over a real link to the simulated vehicle: up, there, at another speed, over losses, the last resort."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import pytest

from mapping.geometry.frames import apart_m
from telemetry.errors import NotAllowedError
from telemetry.simulation.simulator.run import SimOptions, Simulator, flying
from telemetry.topics.messages import CommandRecord, GuidedTarget
from telemetry.topics.requests import (
    Connect,
    FlyManoeuvre,
    FlyWay,
    Land,
    Pause,
    Resume,
    SetSpeed,
    StartGuided,
    StopMotors,
)
from tests.free_ports import free_port
from tests.telemetry.link_bench import ME, Console, console, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_flights import LAT_DEG, LON_DEG, QUICKLY_DOWN
from tests.telemetry.udp_faults import Proxy, lossy_udp

UP_M = 8.0
THERE = (LAT_DEG + 2e-4, LON_DEG)


def target(lat_deg: float, lon_deg: float, up_m: float, speed_m_s: float = 3.0) -> GuidedTarget:
    return GuidedTarget(0, lat_deg, lon_deg, up_m, speed_m_s)


def way(bench: Console, *targets: GuidedTarget, most_m_s: float = 4.0) -> FlyWay:
    state = bench.state
    assert state.lat_deg is not None
    assert state.lon_deg is not None
    assert state.alt_rel_home_m is not None
    return FlyWay(ME, targets, state.lat_deg, state.lon_deg, state.alt_rel_home_m, most_m_s)


@contextlib.asynccontextmanager
async def simulated(
    *, loss: float = 0.0, speedup: float = 8.0, led: bool = False
) -> AsyncIterator[tuple[Console, Simulator, Proxy]]:
    """``led``: along the legs, by the clock on the wall; else it flies straight legs by itself, in its own time."""
    port, settings = free_port(), QUICKLY_DOWN if led else (*QUICKLY_DOWN, ("GUID_OPTIONS", 64.0))
    if loss:
        # Take-off is ordered anew each 6 s where the order is lost: twice, and a vehicle has its motors off again.
        settings = (*settings, ("DISARM_DELAY", 0.0))
    options: Any = {"link": f"udpin:127.0.0.1:{port}", "speedup": speedup, "boot_s": 0.5, "parameters": settings}
    async with (
        flying(SimOptions(LAT_DEG, LON_DEG, 800.0, **options)) as simulator,
        lossy_udp(port, loss=loss, seed=7) as proxy,
        console() as bench,
    ):
        await bench.handle(Connect(ME, f"udpout:127.0.0.1:{proxy.port}", True))
        await bench.live()
        await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
        await until(lambda: bench.link.session is not None and not bench.link.session.transfers.is_busy)
        yield bench, simulator, proxy


async def take_off(bench: Console) -> None:
    up = StartGuided(ME, (target(LAT_DEG, LON_DEG, UP_M),), UP_M, end="hold")
    await bench.handle(up)
    await until(lambda: bench.flight.phase == "paused" and "holds there" in bench.flight.hint)


async def there(bench: Console) -> None:
    await until(lambda: bench.flight.phase == "paused" and "holds there" in bench.flight.hint)


def off_m(bench: Console, place: tuple[float, float], up_m: float) -> float:
    state = bench.state
    flat_m = apart_m(place, (state.lat_deg or 0.0, state.lon_deg or 0.0))
    return math.hypot(flat_m, (state.alt_rel_home_m or 0.0) - up_m)


@pytest.mark.parametrize("loss", [0.0, 0.1])
def test_up_there_and_down_again(loss: float) -> None:
    async def whole() -> None:
        async with simulated(loss=loss, speedup=8.0 if loss == 0.0 else 4.0) as (bench, _, proxy):
            await take_off(bench)
            assert off_m(bench, (LAT_DEG, LON_DEG), UP_M) < 1.5
            await until(lambda: (bench.state.ground_speed_m_s or 0.0) < 0.5)
            await bench.handle(way(bench, target(LAT_DEG, LON_DEG, 12.0), target(*THERE, 12.0), target(*THERE, 9.0)))
            assert bench.flight.way == "guided"
            assert bench.flight.target is None
            await there(bench)
            assert off_m(bench, THERE, 9.0) < 1.5
            assert proxy.carried > 0
            assert (proxy.lost > 0) == (loss > 0.0)
            await bench.handle(Land(ME))
            await until(lambda: not bench.state.armed)
            words = [record.words for record in bench.of(CommandRecord)]
            assert any(text.startswith("fly a certified way of 3 places to -36.9998") for text in words)

    run(whole)


def test_a_way_past_an_obstacle_that_rejoins_a_mission_is_refused_while_a_certified_way_is_flown() -> None:
    """Nothing of a way would be left after it: a way home would land beside its place."""

    async def whole() -> None:
        async with simulated() as (bench, _, _proxy):
            await take_off(bench)
            await until(lambda: (bench.state.ground_speed_m_s or 0.0) < 0.5)
            home = replace(way(bench, target(LAT_DEG + 1e-3, LON_DEG, UP_M)), end="land")
            await bench.handle(home)
            aside = (target(*THERE, UP_M),)
            with pytest.raises(NotAllowedError, match="it has no item 4 to go on from"):
                await bench.handle(FlyManoeuvre(ME, "around", aside, 4))
            assert bench.flight.phase == "flying"
            await bench.handle(Pause(ME))
            await until(lambda: bench.flight.phase == "paused")
            with pytest.raises(NotAllowedError, match="it has no item 4 to go on from"):
                await bench.handle(FlyManoeuvre(ME, "around", aside, 4))
            assert bench.state.armed

    run(whole)


def test_on_the_way_it_holds_goes_on_and_changes_its_speed_within_what_is_certified() -> None:
    async def whole() -> None:
        async with simulated(speedup=1.0, led=True) as (bench, _, _proxy):
            with pytest.raises(NotAllowedError, match="not in the air"):
                await bench.handle(way(bench, target(*THERE, UP_M)))
            await take_off(bench)
            with pytest.raises(NotAllowedError, match="No guided way"):
                await bench.handle(SetSpeed(ME, 2.0))
            far = target(LAT_DEG + 1e-3, LON_DEG, UP_M)
            with pytest.raises(NotAllowedError, match="faster than certified"):
                await bench.handle(way(bench, far, most_m_s=2.0))
            await bench.handle(way(bench, far))
            await until(lambda: bench.flight.phase == "flying" and (bench.state.ground_speed_m_s or 0.0) > 2.2)
            with pytest.raises(NotAllowedError, match="moves at"):
                await bench.handle(way(bench, target(*THERE, UP_M)))
            assert bench.flight.phase == "flying"  # what was refused ended nothing
            for speed_m_s in (5.0, 0.0, math.nan):
                with pytest.raises(NotAllowedError, match="certified for at most 4 m/s"):
                    await bench.handle(SetSpeed(ME, speed_m_s))
            await bench.handle(SetSpeed(ME, 1.0))
            await until(lambda: 0.5 < (bench.state.ground_speed_m_s or 0.0) < 1.3)
            await bench.handle(Pause(ME))
            await until(lambda: (bench.state.ground_speed_m_s or 9.0) < 0.4)
            assert bench.flight.phase == "paused"
            await bench.handle(Resume(ME))
            await until(lambda: (bench.state.ground_speed_m_s or 0.0) > 0.6)
            await bench.handle(Pause(ME))
            await until(lambda: (bench.state.ground_speed_m_s or 9.0) < 0.4)
            await bench.handle(way(bench, target(bench.state.lat_deg or 0.0, bench.state.lon_deg or 0.0, UP_M)))
            await there(bench)
            with pytest.raises(NotAllowedError, match="nothing is paused"):
                await bench.handle(Resume(ME))

    run(whole)


def test_a_command_that_comes_between_is_the_one_that_is_obeyed() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _, _proxy):
            await take_off(bench)
            asked = asyncio.create_task(bench.handle(way(bench, target(*THERE, UP_M))))
            await asyncio.sleep(0)
            await bench.handle(Land(ME))
            with pytest.raises(NotAllowedError, match="Another command was given"):
                await asked
            await until(lambda: not bench.state.armed)

    run(whole)


def test_the_motors_stop_in_the_air_and_it_is_written_down() -> None:
    async def whole() -> None:
        async with simulated() as (bench, simulator, _proxy):
            await take_off(bench)
            await bench.handle(StopMotors(ME))
            await until(lambda: not bench.state.armed)
            assert not simulator.vehicle.autopilot.armed
            assert "stop the motors in the air" in bench.commands
            assert bench.flight.phase == "interrupted"

    run(whole)
