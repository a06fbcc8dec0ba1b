"""Another mission for a vehicle in flight, over real sockets: put on board while it holds, flown only from there."""

from __future__ import annotations

import contextlib
import math
from collections.abc import AsyncIterator
from dataclasses import replace

import pytest

from telemetry.errors import MissionUnknownError, NotAllowedError, TelemetryError
from telemetry.simulation.simulator.run import Simulator
from telemetry.topics.onboard_lists import Item, UploadReport
from telemetry.topics.requests import Download, Pause, Resume, StartAuto, TakeUp, Upload
from tests.telemetry.link_bench import ME, Console, until
from tests.telemetry.own_time import run
from tests.telemetry.test_mavlink_flights import (
    ALT_M,
    LAT_DEG,
    LON_DEG,
    QUICKLY_DOWN,
    STEP_DEG,
    items,
    phase,
    simulated,
    start,
    upload,
)
from tests.telemetry.test_px4_flights import QUICK

VEHICLES = [("ardupilot", QUICKLY_DOWN), ("px4", QUICK)]


@contextlib.asynccontextmanager
async def holding(autopilot: str, parameters: object) -> AsyncIterator[tuple[Console, Simulator, str]]:
    """In the middle of a long mission; its digest."""
    async with simulated(autopilot=autopilot, parameters=parameters, speedup=8.0) as (bench, simulator):
        report = await upload(bench, items(8))
        await start(bench, StartAuto(ME, report.onboard.digest))
        await until(lambda: bench.flight.phase == "flying" and (bench.flight.target or 0) >= 3)
        await bench.handle(Pause(ME))
        await still(bench)
        yield bench, simulator, report.onboard.digest


async def still(bench: Console) -> None:
    def is_still() -> bool:
        state = bench.state
        speed_m_s = math.hypot(state.ground_speed_m_s or 0.0, state.climb_m_s or 0.0)
        return state.mode in ("BRAKE", "HOLD") and speed_m_s < 0.2 and bench.flight.phase == "paused"

    await until(is_still)


def rest_from(bench: Console) -> tuple[Item, ...]:
    """From where it hovers to two places in the east, and home."""
    none, state = (0.0, 0.0, 0.0, 0.0), bench.state
    assert state.lat_deg is not None
    assert state.lon_deg is not None
    assert state.alt_rel_home_m is not None
    east = [(state.lat_deg, state.lon_deg + k * STEP_DEG, 20.0) for k in (1, 2)]
    here = Item(16, 3, none, state.lat_deg, state.lon_deg, state.alt_rel_home_m)
    return (here, *(Item(16, 3, none, *place) for place in east), Item(20, 0, none, 0.0, 0.0, 0.0))


def taking_up(bench: Console, digest: str, *, north_m: float = 0.0) -> TakeUp:
    state = bench.state
    assert state.lat_deg is not None
    assert state.lon_deg is not None
    assert state.alt_rel_home_m is not None
    return TakeUp(ME, digest, state.lat_deg + north_m / 111_000, state.lon_deg, state.alt_rel_home_m)


async def put_on_board(bench: Console) -> UploadReport:
    request = Upload(ME, rest_from(bench), LAT_DEG, LON_DEG, ALT_M, while_holding=True)
    report = await bench.handle(request)
    assert isinstance(report, UploadReport)
    assert report.verified
    return report


@pytest.mark.parametrize(("autopilot", "parameters"), VEHICLES)
def test_it_is_flown_from_where_the_vehicle_holds_once_it_is_taken_up(autopilot: str, parameters: object) -> None:
    async def whole() -> None:
        async with holding(autopilot, parameters) as (bench, _, old):
            report = await put_on_board(bench)
            assert report.onboard.digest != old
            with pytest.raises(MissionUnknownError, match="replaced since it was checked"):
                await bench.handle(Resume(ME))  # what is on board is not what was started, nor was it taken up
            with pytest.raises(MissionUnknownError, match="Another mission"):
                await bench.handle(taking_up(bench, old))
            with pytest.raises(NotAllowedError, match=r"5\.\d m from where the certified way begins"):
                await bench.handle(taking_up(bench, report.onboard.digest, north_m=5.5))

            await bench.handle(taking_up(bench, report.onboard.digest))
            assert (bench.flight.phase, bench.flight.target, bench.flight.targets) == ("paused", 1, 4)
            await until(lambda: bench.state.mission_item == (1 if autopilot == "ardupilot" else 0))
            assert any(words.startswith("take up mission") for words in bench.commands)
            await bench.handle(Resume(ME))
            await until(lambda: bench.flight.phase == "flying" and (bench.flight.target or 0) >= 2)
            east = bench.state.lon_deg
            await phase(bench, "returning")
            assert east is not None
            assert (bench.state.lon_deg or 0.0) > LON_DEG + STEP_DEG, "it flew to the east"
            await phase(bench, "landed")
            assert bench.flight.broke_off_at is None

    run(whole)


@pytest.mark.parametrize(("autopilot", "parameters"), VEHICLES)
def test_a_vehicle_that_does_not_hold_keeps_its_mission(autopilot: str, parameters: object) -> None:
    async def whole() -> None:
        async with holding(autopilot, parameters) as (bench, _, old):
            rest = Upload(ME, rest_from(bench), LAT_DEG, LON_DEG, ALT_M, while_holding=True)
            await bench.handle(Resume(ME))
            await until(lambda: bench.flight.phase == "flying")
            with pytest.raises(NotAllowedError, match=r"does not hold: it is in (AUTO|MISSION)"):
                await bench.handle(rest)
            with pytest.raises(NotAllowedError, match="being flown"):
                await bench.handle(replace(rest, while_holding=False))
            assert (await bench.handle(Download(ME))).digest == old

    run(whole)


@pytest.mark.parametrize(("autopilot", "parameters"), VEHICLES)
def test_an_upload_that_breaks_off_in_the_middle_leaves_it_holding(autopilot: str, parameters: object) -> None:
    """ArduPilot then holds a mixture, which is not flown; PX4 still holds the mission before, which may be."""

    async def whole() -> None:
        async with holding(autopilot, parameters) as (bench, _, old):
            rest = rest_from(bench)
            broken = (rest[0], rest[1], replace(rest[2], command=65_000), rest[3])  # no vehicle knows this one
            with pytest.raises(TelemetryError):
                await bench.handle(Upload(ME, broken, LAT_DEG, LON_DEG, ALT_M, while_holding=True))
            assert bench.status.mission_state == "unknown"
            with pytest.raises(MissionUnknownError, match="not known any more"):
                await bench.handle(Resume(ME))
            kept = await bench.handle(Download(ME))
            assert (kept.digest == old) == (autopilot == "px4")
            assert bench.state.mode in ("BRAKE", "HOLD")
            if autopilot == "ardupilot":
                with pytest.raises(MissionUnknownError, match="Another mission"):
                    await bench.handle(Resume(ME))
                report = await put_on_board(bench)
                await bench.handle(taking_up(bench, report.onboard.digest))
            await bench.handle(Resume(ME))
            await phase(bench, "flying")

    run(whole)


def test_a_mission_that_was_taken_up_is_not_flown_from_elsewhere() -> None:
    async def whole() -> None:
        async with holding("ardupilot", QUICKLY_DOWN) as (bench, _, _):
            report = await put_on_board(bench)
            await bench.handle(taking_up(bench, report.onboard.digest))
            vehicle = bench.vehicle
            assert vehicle is not None
            state = bench.state
            await vehicle.obey(vehicle.orders.go_to(LAT_DEG, LON_DEG + 4 * STEP_DEG, 20.0))  # another station's
            await until(lambda: (bench.state.lon_deg or 0.0) > (state.lon_deg or 0.0) + STEP_DEG)
            await bench.handle(Pause(ME))
            await still(bench)
            with pytest.raises(NotAllowedError, match="from where the certified way begins"):
                await bench.handle(Resume(ME))
            assert bench.state.mode == "BRAKE"

    run(whole)
