"""Whole flights of the simulated vehicle over the link: in AUTO, in GUIDED, broken off, resumed, interfered with."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import pytest

from telemetry.errors import MissionUnknownError, NotAllowedError, RefusedError
from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.run import SimOptions, Simulator, flying
from telemetry.topics.messages import CommandRecord, FlightStatus, GuidedTarget, LinkStatus
from telemetry.topics.onboard_lists import Item, UploadReport
from telemetry.topics.requests import (
    Arm,
    Connect,
    Disarm,
    Download,
    Pause,
    ReadParameters,
    Resume,
    ReturnHome,
    StartAuto,
    StartGuided,
    Upload,
)
from tests.telemetry.link_bench import ME, Console, console, until
from tests.telemetry.own_time import run

LAT_DEG, LON_DEG, ALT_M = -37.0, 175.0, 800.0
STEP_DEG = 8e-5
QUICKLY_DOWN = (("LAND_SPEED", 150.0), ("LAND_ALT_LOW", 200.0))


def items(waypoints: int = 3) -> tuple[Item, ...]:
    none = (0.0, 0.0, 0.0, 0.0)
    places = [(LAT_DEG + k * STEP_DEG, LON_DEG, 12.006 + k) for k in range(1, waypoints + 1)]
    return (
        Item(22, 3, none, LAT_DEG, LON_DEG, 10.0),
        *(Item(16, 3, none, *place) for place in places),
        Item(20, 0, none, 0.0, 0.0, 0.0),
    )


TARGETS = tuple(
    GuidedTarget(number, item.lat_deg, item.lon_deg, item.alt_m, 3.0)
    for number, item in enumerate(items(), start=1)
    if item.command == 16
)


@contextlib.asynccontextmanager
async def simulated(**options: Any) -> AsyncIterator[tuple[Console, Simulator]]:
    wanted: dict[str, Any] = {"link": "tcpin:127.0.0.1:0", "speedup": 15.0, "boot_s": 0.5, "parameters": QUICKLY_DOWN}
    wanted |= options
    async with flying(SimOptions(LAT_DEG, LON_DEG, ALT_M, **wanted)) as simulator, console() as bench:
        await bench.handle(Connect(ME, simulator.address.replace("tcpin", "tcp"), True))
        await bench.live()
        yield bench, simulator


async def upload(bench: Console, mission: tuple[Item, ...] | None = None) -> UploadReport:
    await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
    report = await bench.handle(Upload(ME, mission or items(), LAT_DEG, LON_DEG, ALT_M))
    assert isinstance(report, UploadReport)
    return report


async def start(bench: Console, request: StartAuto | StartGuided) -> None:
    """A vehicle whose position estimate has just settled may refuse at first."""
    for _ in range(100):
        try:
            await bench.handle(request)
        except RefusedError:
            await until(lambda: not bench.pilot or bench.flight.phase in ("idle", "interrupted"))
            continue
        return
    raise AssertionError("the vehicle never took off")


async def phase(bench: Console, wanted: str) -> None:
    await until(lambda: bench.flight.phase == wanted)


def phases(bench: Console) -> list[str]:
    """Every phase once, in order."""
    found = [status.phase for status in bench.of(FlightStatus)]
    return [p for k, p in enumerate(found) if k == 0 or found[k - 1] != p]


def test_a_mission_is_uploaded_verified_and_flown() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _):
            report = await upload(bench)
            assert report.verified
            assert (bench.status.mission_state, bench.status.mission_digest) == ("verified", report.onboard.digest)
            assert [t.phase for t in bench.transfers][-1] == "done"
            await start(bench, StartAuto(ME, report.onboard.digest))
            await phase(bench, "landed")
            assert phases(bench)[-4:] == ["taking_off", "flying", "returning", "landed"]
            assert bench.flight.broke_off_at is None
            assert {"upload 5 items"} <= set(bench.commands)
            assert bench.state.home_lat_deg == pytest.approx(LAT_DEG, abs=1e-5)

    run(whole)


def test_a_mission_is_paused_resumed_broken_off_and_gone_on_with() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _):
            report = await upload(bench, items(8))
            await start(bench, StartAuto(ME, report.onboard.digest))
            await phase(bench, "flying")
            await bench.handle(Pause(ME))
            await phase(bench, "paused")
            await until(lambda: bench.state.mode == "BRAKE")
            with pytest.raises(NotAllowedError, match="being flown"):
                await bench.handle(Upload(ME, items(), LAT_DEG, LON_DEG, ALT_M))
            with pytest.raises(NotAllowedError, match="already flying"):
                await bench.handle(StartAuto(ME, report.onboard.digest))
            await bench.handle(Resume(ME))
            await until(lambda: bench.flight.phase == "flying" and (bench.flight.target or 0) >= 3)
            await bench.handle(ReturnHome(ME))
            await phase(bench, "interrupted")
            at = bench.flight.broke_off_at
            assert at is not None
            assert at >= 3
            await upload(bench, tuple(replace(item, alt_m=item.alt_m + 1.0) for item in items(8)))
            assert bench.flight.broke_off_at == at  # its heights only are others: home was moved
            await upload(bench, items(2))
            assert bench.flight.broke_off_at is None  # of another route nothing was flown
            report = await upload(bench, items(8))
            await start(bench, StartAuto(ME, report.onboard.digest, from_item=at, climb_to_m=25.0))
            await until(lambda: (bench.state.alt_rel_home_m or 0.0) > 24.0)
            assert bench.state.mode == "GUIDED"
            await phase(bench, "landed")
            reached = [s.target for s in bench.of(FlightStatus) if s.phase == "flying"][-4:]
            assert reached == sorted(reached)
            assert min(t for t in reached if t) >= at

    run(whole)


def test_speeds_are_set_again_and_a_replaced_mission_is_not_resumed() -> None:
    slow = Item(178, 2, (1.0, 2.5, -1.0, 0.0), 0.0, 0.0, 0.0)

    async def whole() -> None:
        async with simulated() as (bench, simulator):
            first, *rest = items(8)
            report = await upload(bench, (first, slow, *rest))
            await start(bench, StartAuto(ME, report.onboard.digest))
            await until(lambda: bench.flight.phase == "flying" and (bench.flight.target or 0) >= 3)
            await bench.handle(Pause(ME))
            await phase(bench, "paused")
            pilot = simulator.vehicle.autopilot
            assert isinstance(pilot, Autopilot)
            assert pilot.speed_m_s is None
            await bench.handle(Resume(ME))
            await until(lambda: pilot.speed_m_s == 2.5)
            await bench.handle(Pause(ME))
            await phase(bench, "paused")
            assert bench.vehicle is not None
            bench.vehicle.onboard.forget()
            with pytest.raises(MissionUnknownError, match="not known any more"):
                await bench.handle(Resume(ME))
            await bench.handle(ReturnHome(ME))
            await phase(bench, "returning")

    run(whole)


def test_the_way_home_of_the_script_can_be_paused() -> None:
    async def whole() -> None:
        async with simulated(speedup=5.0, parameters=()) as (bench, _):  # it creeps down: no stall is longer
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            await start(bench, StartGuided(ME, TARGETS[:1], 10.0))
            await phase(bench, "returning")
            await bench.handle(Pause(ME))
            await until(lambda: bench.state.mode == "BRAKE")
            await phase(bench, "interrupted")

    run(whole)


class SlowDisk:
    """An audit log whose disk takes its time over an upload of six items."""

    def __init__(self) -> None:
        self.goes_on = threading.Event()

    head = id = ""

    def check(self) -> str:
        return ""

    def write(self, record: CommandRecord) -> object:
        if record.words.startswith("upload 6") and not record.result:
            self.goes_on.wait(60)
        return None


def test_an_upload_that_waited_for_the_disk_does_not_meet_a_started_mission() -> None:
    async def whole() -> None:
        disk = SlowDisk()
        options = SimOptions(LAT_DEG, LON_DEG, ALT_M, link="tcpin:127.0.0.1:0", speedup=15.0, boot_s=0.5)
        async with flying(options) as simulator, console(audit=disk) as bench:
            await bench.handle(Connect(ME, simulator.address.replace("tcpin", "tcp"), True))
            await bench.live()
            await upload(bench)
            late = asyncio.create_task(bench.handle(Upload(ME, items(4), LAT_DEG, LON_DEG, ALT_M)))
            try:
                await until(lambda: "upload 6 items" in bench.commands)
                bench.link.flight.begin(5, 1.7e9)
            finally:
                disk.goes_on.set()
            with pytest.raises(NotAllowedError, match="being flown"):
                await late

    run(whole)


def test_the_navigation_script_is_paused_resumed_and_flown_to_its_end() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _):
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            await start(bench, StartGuided(ME, TARGETS[:2], 10.0))
            await phase(bench, "flying")
            await bench.handle(Pause(ME))
            await phase(bench, "paused")
            with pytest.raises(NotAllowedError, match="being flown"):
                await bench.handle(Upload(ME, items(), LAT_DEG, LON_DEG, ALT_M))
            await bench.handle(Resume(ME))
            await phase(bench, "landed")
            assert phases(bench)[-3:] == ["flying", "returning", "landed"]
            assert bench.flight.way == "guided"

    run(whole)


def test_a_vehicle_that_flies_curves_in_guided_is_told_with_the_setting_that_mends_it() -> None:
    async def whole(options: float) -> str:
        async with simulated(parameters=(*QUICKLY_DOWN, ("GUID_OPTIONS", options))) as (bench, _):
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            await start(bench, StartGuided(ME, TARGETS, 10.0))
            await phase(bench, "taking_off")
            hint = bench.flight.hint
            await bench.handle(ReturnHome(ME))
            return hint

    for options, words in ((0.0, "Set GUID_OPTIONS 64"), (1.0, "Set GUID_OPTIONS 65"), (64.0, "")):
        hints: list[str] = []

        async def one(options: float = options, hints: list[str] = hints) -> None:
            hints.append(await whole(options))

        run(one)
        assert words in hints[0]
        assert bool(hints[0]) is bool(words)


def test_the_way_home_ends_the_script_and_tells_where() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _):
            await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
            await start(bench, StartGuided(ME, TARGETS, 10.0))
            await phase(bench, "flying")
            await bench.handle(ReturnHome(ME))
            await phase(bench, "returning")
            assert bench.flight.broke_off_at is not None
            await phase(bench, "interrupted")
            assert bench.flight.broke_off_at is not None

    run(whole)


def test_without_a_console_the_script_holds_its_position() -> None:
    async def whole() -> None:
        async with flying(
            SimOptions(LAT_DEG, LON_DEG, ALT_M, link="tcpin:127.0.0.1:0", speedup=10.0, boot_s=0.5)
        ) as simulator:
            age_s = 0.0
            async with console(server_age_s=lambda: age_s) as bench:
                await bench.handle(Connect(ME, simulator.address.replace("tcpin", "tcp"), True))
                await bench.live()
                await until(lambda: bench.state.ready_to_arm and bench.state.estimator_ok)
                await start(bench, StartGuided(ME, TARGETS, 10.0))
                await phase(bench, "flying")
                age_s = 11.0
                await phase(bench, "paused")
                assert "hold: the console is gone" in bench.commands

    run(whole)


def test_a_vehicle_that_is_not_ready_says_why() -> None:
    async def whole() -> None:
        async with simulated(boot_s=500.0, speedup=1.0) as (bench, _):
            with pytest.raises(RefusedError, match="It says"):
                await bench.handle(Arm(ME))

    run(whole)


@pytest.mark.fact("A28")
def test_what_was_not_read_back_is_not_flown() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _):
            await until(lambda: bench.status.mission_state == "none")
            with pytest.raises(MissionUnknownError, match="no mission on board"):
                await bench.handle(StartAuto(ME, "digest"))
            report = await upload(bench)
            with pytest.raises(MissionUnknownError, match="another one"):
                await bench.handle(StartAuto(ME, "digest"))
            with pytest.raises(NotAllowedError, match="no item 9"):
                await bench.handle(StartAuto(ME, report.onboard.digest, from_item=9, climb_to_m=20.0))
            with pytest.raises(NotAllowedError, match="a height"):
                await bench.handle(StartAuto(ME, report.onboard.digest, from_item=3))
            onboard = await bench.handle(Download(ME))
            assert onboard == report.onboard

    run(whole)


def test_a_mission_that_would_begin_again_is_not_resumed() -> None:
    async def whole() -> None:
        async with simulated() as (bench, simulator):
            report = await upload(bench, items(8))
            await start(bench, StartAuto(ME, report.onboard.digest))
            await phase(bench, "flying")
            await bench.handle(Pause(ME))
            await phase(bench, "paused")
            simulator.vehicle.autopilot.parameters.set("MIS_RESTART", 1.0)
            with pytest.raises(NotAllowedError, match="begin its mission again"):
                await bench.handle(Resume(ME))
            with pytest.raises(NotAllowedError, match="in the air"):
                await bench.handle(Disarm(ME))

    run(whole)


def test_parameters_are_read_by_name() -> None:
    async def whole() -> None:
        async with simulated() as (bench, _):
            values = await bench.handle(ReadParameters(("RTL_ALT", "MIS_RESTART")))
            assert values == {"RTL_ALT": 1500.0, "MIS_RESTART": 0.0}

    run(whole)


def test_another_ground_stations_upload_is_noticed_and_read_back() -> None:
    async def whole() -> None:
        async with simulated() as (bench, simulator), console() as other:
            report = await upload(bench)
            await other.handle(Connect(ME, simulator.address.replace("tcpin", "tcp"), True))
            await other.live()
            foreign = await upload(other, items(5))
            await until(lambda: bench.status.mission_digest == foreign.onboard.digest)
            told = [s.mission_state for s in bench.of(LinkStatus)]
            assert "unknown" in told[told.index("verified") :]
            with pytest.raises(MissionUnknownError):
                await bench.handle(StartAuto(ME, report.onboard.digest))

    run(whole)
