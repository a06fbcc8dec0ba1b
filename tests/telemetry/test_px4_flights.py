"""Whole flights of the simulated PX4 over Hedgehop's own link, on real sockets: in MISSION, and place after place."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator

import pytest

from telemetry.simulation.simulator.run import Simulator
from telemetry.topics.messages import FlightStatus, GuidedTarget
from telemetry.topics.requests import Land, Pause, ReadParameters, Resume, ReturnHome, StartAuto, StartGuided
from tests.telemetry.link_bench import ME, Console, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_flights import (
    LAT_DEG,
    LON_DEG,
    STEP_DEG,
    items,
    phase,
    phases,
    simulated,
    start,
    upload,
)

QUICK = (
    ("MPC_LAND_SPEED", 1.5), ("MPC_LAND_CRWL", 1.0), ("RTL_RETURN_ALT", 15.0), ("MPC_TKO_RAMP_T", 0.5),
)  # fmt: skip
TARGETS = tuple(GuidedTarget(k, LAT_DEG + k * STEP_DEG, LON_DEG, 12.0 + k, 3.0) for k in (1, 2, 3))


@contextlib.asynccontextmanager
async def px4() -> AsyncIterator[tuple[Console, Simulator]]:
    async with simulated(autopilot="px4", parameters=QUICK, speedup=6.0) as (bench, simulator):
        yield bench, simulator


@pytest.mark.fact("P14")
def test_a_mission_is_uploaded_verified_started_held_and_flown() -> None:
    async def whole() -> None:
        async with px4() as (bench, _):
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            report = await upload(bench)
            assert (report.verified, report.rounded, report.differences) == (True, (), ())
            assert [item.command for item in report.onboard.items] == [22, 16, 16, 16, 20]
            await start(bench, StartAuto(ME, report.onboard.digest))
            await phase(bench, "flying")
            await bench.handle(Pause(ME))
            await phase(bench, "paused")
            await until(lambda: bench.state.mode == "HOLD")
            await bench.handle(Resume(ME))
            await until(lambda: bench.state.mode == "MISSION")
            await phase(bench, "landed")
            assert phases(bench)[-3:] == ["flying", "returning", "landed"]
            assert (bench.flight.broke_off_at, bench.flight.targets) == (None, 5)
            # On the ground; a moment later its motors are off, and its mode is the one that was chosen last.
            await until(lambda: (bench.state.mode, bench.state.armed) == ("HOLD", False))

    run(whole)


@pytest.mark.fact("P15")
def test_return_and_land_are_obeyed_and_parameters_read_bytewise() -> None:
    async def whole() -> None:
        async with px4() as (bench, _):
            report = await upload(bench, items(8))
            read = await bench.handle(ReadParameters(("RTL_CONE_ANG", "RTL_MIN_DIST", "GF_ACTION")))
            assert read == {"RTL_CONE_ANG": 45.0, "RTL_MIN_DIST": 10.0, "GF_ACTION": 2.0}
            await start(bench, StartAuto(ME, report.onboard.digest))
            await until(lambda: bench.flight.phase == "flying" and (bench.flight.target or 0) >= 3)
            await bench.handle(ReturnHome(ME))
            await until(lambda: bench.state.mode == "RTL")
            await bench.handle(Land(ME))
            await until(lambda: bench.state.mode == "LAND")
            await phase(bench, "interrupted")
            assert (bench.flight.broke_off_at or 0) >= 3

    run(whole)


def test_it_is_led_from_place_to_place_in_hold() -> None:
    async def whole() -> None:
        async with px4() as (bench, simulator):
            await until(lambda: bench.state.ready_to_arm and bench.state.home_lat_deg is not None)
            await start(bench, StartGuided(ME, TARGETS, 10.0, end="rtl"))
            await until(lambda: bench.flight.phase == "flying" and bench.state.mode == "HOLD")
            await phase(bench, "landed")
            reached = [status.target for status in bench.of(FlightStatus) if status.phase == "flying"]
            assert list(dict.fromkeys(reached)) == [1, 2, 3]
            assert simulator.vehicle.autopilot.home_neu[0] == pytest.approx(0.0, abs=2.0)

    run(whole)
