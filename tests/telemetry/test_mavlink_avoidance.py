"""Avoidance over real sockets: consent, a wall on the way in AUTO and on the script's way, prepared ways, orders."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import pytest

from telemetry.errors import NotAllowedError
from telemetry.simulation.simulator.run import Simulator
from telemetry.topics.messages import FlightStatus, GuidedTarget
from telemetry.topics.obstacles import AvoidanceStatus, PerceptionSettings, PerceptionStatus, Region
from telemetry.topics.requests import FlyManoeuvre, Pause, Resume, ReturnHome, SetAvoidance, StartAuto, StartGuided
from tests.telemetry.avoiding_bench import Wall, seen_at
from tests.telemetry.link_bench import ME, Console, again_and_again, until
from tests.telemetry.own_time import run
from tests.telemetry.test_guided_over_link import way
from tests.telemetry.test_mavlink_flights import (
    LAT_DEG,
    LON_DEG,
    STEP_DEG,
    TARGETS,
    phase,
    simulated,
    start,
    upload,
)

SPEEDUP, HURRIED = 3.0, 15.0
"""Frames come in real time: it takes off and goes home faster than it flies towards a wall."""
WALL = Wall(14.0, 17.0, thick_m=3.0)
FRAME_S = 0.05
CLIMBED = ["off", "watching", "climbing", "offset"]


def avoidance(bench: Console) -> AvoidanceStatus:
    return bench.last(AvoidanceStatus) or AvoidanceStatus()


def states(bench: Console) -> list[str]:
    found = [status.state for status in bench.of(AvoidanceStatus)]
    return [state for k, state in enumerate(found) if k == 0 or found[k - 1] != state]


def climbing_states(bench: Console) -> list[str]:
    """Each once, in their order; on the way it may hold or not."""
    return [state for state in dict.fromkeys(states(bench)) if state != "holding"]


def seen(simulator: Simulator, wall: Wall | None) -> PerceptionStatus:
    north_m, _, up_m = simulator.vehicle.truth.p_neu
    ahead_m = None if wall is None else wall.ahead_m(north_m, up_m, 9.0)
    now_s = time.monotonic()
    return PerceptionStatus(
        sensor="vision",
        state="running",
        text="",
        t_mono_s=now_s,
        t_utc_s=0.0,
        done_t_mono_s=now_s,
        region=Region((0.0, 0.0, 0.0), 0.0, 9.0, math.radians(24), 2.0, ahead_m is not None),
        obstacles=() if ahead_m is None else (seen_at(ahead_m),),
    )


@contextlib.asynccontextmanager
async def before_a_wall(wall: Wall | None = WALL) -> AsyncIterator[tuple[Console, Simulator]]:
    """A simulated vehicle whose camera sees this wall, and avoidance switched on."""
    async with (
        simulated(speedup=HURRIED) as (bench, simulator),
        again_and_again(lambda: bench.link.on_perception(seen(simulator, wall)), FRAME_S),
    ):
        yield bench, simulator


async def taken_off(bench: Console, simulator: Simulator) -> None:
    await phase(bench, "flying")
    simulator.options = replace(simulator.options, speedup=SPEEDUP)


async def landed(bench: Console, simulator: Simulator) -> None:
    await phase(bench, "returning")
    simulator.options = replace(simulator.options, speedup=HURRIED)
    await phase(bench, "landed")


async def switch_on(bench: Console) -> None:
    await bench.handle(SetAvoidance(ME, enabled=True))
    await until(lambda: avoidance(bench).state == "watching")


async def taken_over_on_the_scripts_way(bench: Console, simulator: Simulator) -> None:
    await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
    await switch_on(bench)
    await start(bench, StartGuided(ME, TARGETS, 10.0))
    await taken_off(bench, simulator)
    await until(lambda: avoidance(bench).state in ("climbing", "holding"))


def test_a_real_vehicle_needs_consent_and_a_simulated_one_does_not() -> None:
    async def whole() -> None:
        async with simulated(speedup=1.0) as (bench, _):
            vehicle = bench.vehicle
            assert vehicle is not None
            await until(lambda: vehicle.capabilities is not None)
            vehicle.is_simulation = False
            with pytest.raises(NotAllowedError, match="consent"):
                await bench.handle(SetAvoidance(ME, enabled=True))
            await until(lambda: avoidance(bench).state == "off")
            await bench.handle(SetAvoidance(ME, enabled=True, consent=True))
            await until(lambda: avoidance(bench).state in ("watching", "blind"))
            assert "avoidance on, with consent" in bench.commands
            await bench.handle(SetAvoidance(ME, enabled=False))
            await until(lambda: avoidance(bench).state == "off")
            vehicle.is_simulation = True
            await bench.handle(SetAvoidance(ME, enabled=True))
            await until(lambda: avoidance(bench).state in ("watching", "blind"))
            with pytest.raises(NotAllowedError, match="not in the air"):
                await bench.handle(FlyManoeuvre(ME, "over", TARGETS, None))
            assert bench.status.state == "live"

    run(whole)


def test_other_autopilots_are_refused() -> None:
    async def whole() -> None:
        async with simulated(speedup=1.0) as (bench, _):
            assert bench.pilot is not None
            vehicle: Any = bench.vehicle
            vehicle.state = type(vehicle.state)(1, 1, autopilot="other")
            with pytest.raises(NotAllowedError, match="ArduPilot and PX4 only"):
                bench.pilot.avoidance.check_autopilot()

    run(whole)


@pytest.mark.fact("A36")
def test_in_auto_it_climbs_over_a_wall_and_the_flight_ends_as_planned() -> None:
    async def whole() -> None:
        async with before_a_wall() as (bench, simulator):
            report = await upload(bench)
            await switch_on(bench)
            await start(bench, StartAuto(ME, report.onboard.digest))
            await taken_off(bench, simulator)
            await until(lambda: avoidance(bench).state == "offset")
            assert simulator.vehicle.truth.p_neu[2] > 17.5
            assert avoidance(bench).height_offset_m > 3.0
            await landed(bench, simulator)
            assert bench.flight.broke_off_at is None
            assert bench.flight.way == "auto"
            assert climbing_states(bench) == CLIMBED
            assert "avoidance: climbing" in bench.commands
            assert not simulator.vehicle.autopilot.crashed
            modes = [s.mode for s in bench.of(type(bench.state)) if s.armed]
            assert "AUTO" not in modes[modes.index("BRAKE") :]

    run(whole)


def test_on_the_way_to_where_a_flight_goes_on_it_climbs_over_a_wall_too() -> None:
    """That way is none of the mission's: it was once flown straight into a house that only the sensors knew of."""

    async def whole() -> None:
        async with before_a_wall() as (bench, simulator):
            report = await upload(bench)
            await switch_on(bench)
            last = len(report.onboard.items) - 1
            await start(bench, StartAuto(ME, report.onboard.digest, from_item=last, climb_to_m=10.0))
            await taken_off(bench, simulator)
            await until(lambda: avoidance(bench).state == "offset")
            assert simulator.vehicle.truth.p_neu[2] > 17.0
            await landed(bench, simulator)
            assert bench.flight.broke_off_at is None
            assert not simulator.vehicle.autopilot.crashed

    run(whole)


def test_the_scripts_flight_is_gone_on_with_higher_can_be_paused_and_ends_at_an_order() -> None:
    async def whole() -> None:
        async with before_a_wall() as (bench, simulator):
            await taken_over_on_the_scripts_way(bench, simulator)
            assert bench.flight.way == "guided"
            await until(lambda: avoidance(bench).state == "offset")
            await bench.handle(Pause(ME))
            await until(lambda: bench.state.mode == "BRAKE")
            await phase(bench, "paused")
            await bench.handle(Resume(ME))
            await phase(bench, "flying")
            assert simulator.vehicle.truth.p_neu[2] > 17.0
            await bench.handle(ReturnHome(ME))
            await phase(bench, "returning")
            await until(lambda: avoidance(bench).state == "watching")
            assert bench.flight.broke_off_at is not None

    run(whole)


def test_a_certified_way_that_avoidance_takes_over_at_once_was_accepted() -> None:
    """It was once refused by "another command was given", while it was flown."""

    async def whole() -> None:
        async with before_a_wall() as (bench, simulator):
            await taken_over_on_the_scripts_way(bench, simulator)
            await bench.handle(Pause(ME))
            await until(lambda: (bench.state.ground_speed_m_s or 0.0) < 0.3 and bench.flight.phase == "paused")
            await bench.handle(way(bench, *TARGETS[-1:]))
            await until(lambda: avoidance(bench).state == "offset")
            assert bench.flight.way == "guided"
            await until(lambda: bench.flight.phase == "flying")
            assert simulator.vehicle.truth.p_neu[2] > 17.0

    run(whole)


def test_a_prepared_way_is_flown_and_the_mission_goes_on() -> None:
    async def whole() -> None:
        async with before_a_wall(None) as (bench, simulator):
            report = await upload(bench)
            await start(bench, StartAuto(ME, report.onboard.digest))
            await taken_off(bench, simulator)
            await until(lambda: (bench.flight.target or 0) >= 2)
            aside = tuple(
                GuidedTarget(k, LAT_DEG + north * STEP_DEG, LON_DEG + 1.3e-4, 14.0, 3.0)
                for k, north in enumerate((1.0, 2.0), start=1)
            )
            await bench.handle(FlyManoeuvre(ME, "around", aside, 4))
            await until(lambda: avoidance(bench).state == "manoeuvre")
            await until(lambda: simulator.vehicle.truth.p_neu[1] > 9)
            await landed(bench, simulator)
            assert bench.flight.broke_off_at is None
            assert "fly around an obstacle, 2 places" in bench.commands
            assert states(bench)[-1] == "off"
            assert {status.way for status in bench.of(FlightStatus)} >= {"auto"}

    run(whole)


def test_how_deep_regions_are_is_told_and_outlives_another_adoption() -> None:
    async def whole() -> None:
        async with simulated(speedup=1.0) as (bench, simulator):
            bench.link.on_settings(PerceptionSettings(vehicle_radius_m=2.0))
            bench.link.on_perception(seen(simulator, None))
            await until(lambda: avoidance(bench).sensors == ("vision",))
            slow_m_s = avoidance(bench).largest_speed_m_s
            bench.link.on_settings(PerceptionSettings(vehicle_radius_m=0.2))
            await until(lambda: avoidance(bench).sensors == ())
            bench.link.on_perception(seen(simulator, None))
            await until(lambda: avoidance(bench).sensors == ("vision",))
            fast_m_s = avoidance(bench).largest_speed_m_s
            assert slow_m_s is not None
            assert fast_m_s is not None
            assert fast_m_s > slow_m_s

    run(whole)
