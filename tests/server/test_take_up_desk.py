"""A plan that is taken up in flight, at the desk: refusals leave the vehicle holding, and say what is on board."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planning.fence.fence_model import Fence, circle
from planning.formats.fence_items import fence_items
from server.errors import (
    CheckNeededError,
    ConflictError,
    JobCancelledError,
    NotCertifiedError,
    NotReadyError,
    StaleRevisionError,
)
from server.flying.apart.other_vehicles import PENDING
from server.flying.in_flight import take_up_desk
from server.heard.onboard import onboard
from server.schemas import CheckRow, TakeUpPlan
from server.work.jobs import Lane, Progress
from telemetry.errors import NotAllowedError, SilentError, TransferError
from telemetry.mavlink.items import wire_items
from telemetry.topics.messages import FlightStatus
from telemetry.topics.requests import Pause, Resume, TakeUp
from telemetry.topics.vehicle import VehicleState
from tests.server.flying_desk_bench import ME, Bench, Made

pytestmark = pytest.mark.xdist_group("flying-desk")
HOLDS = "The vehicle holds, and the mission before is still on board"


def hovering(made: Made, *, east_m: float = 8.0, north_m: float = 8.0, up_m: float = 25.0, **more: Any) -> VehicleState:
    """Over the demo's hillside, held; its home is the plan's."""
    there, home = made.standing(east_m=east_m, north_m=north_m), made.standing()
    now_s = time.monotonic()
    told: dict[str, Any] = {
        "armed": True,
        "landed": "in_air",
        "mode": "BRAKE",
        "alt_rel_home_m": up_m,
        "ground_speed_m_s": 0.0,
        "climb_m_s": 0.0,
        "home_lat_deg": home.lat_deg,
        "home_lon_deg": home.lon_deg,
        "home_alt_amsl_m": home.home_alt_amsl_m,
        "position_t_mono_s": now_s,
        "gnss_t_mono_s": now_s,
        "mission_item": 4,
    }
    return replace(there, **(told | more))


async def flown(made: Made, tmp_path: Path, lanes: tuple[Lane, Lane], **more: Any) -> Bench:
    """The demo's plan was uploaded, and the vehicle hovers somewhere on its way."""
    bench = Bench(made, tmp_path / "onboard.json", lanes)
    await bench.ready()
    bench.vehicle.told.clear()
    bench.live.state = hovering(made, **more)
    bench.live.track.states = [made.standing(), bench.live.state]
    return bench


def test_it_is_held_put_on_board_certified_and_taken_up(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        before = bench.vehicle.items
        state = await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert isinstance(bench.vehicle.told[0], Pause), "held before anything else"
        (taken,) = [request for request in bench.vehicle.told if isinstance(request, TakeUp)]
        assert taken.digest == state.onboard.digest
        here = bench.live.state
        assert (taken.begins_lat_deg, taken.begins_lon_deg) == pytest.approx((here.lat_deg, here.lon_deg), abs=1e-8)
        assert state.taken_up is not None
        assert state.taken_up.clearance_m >= state.taken_up.required_m > 1.0
        first, speed = bench.vehicle.items[:2]
        assert (first.command, speed.command) == (16, 178), "its first item is where it hovers"
        assert first.lat_deg == pytest.approx(here.lat_deg, abs=1e-7)
        assert len(bench.vehicle.items) < len(before) + 4
        assert bench.aboard.record is not None
        assert bench.aboard.record.taken_up
        assert bench.aboard.record.certificate_json

    runner.run(scenario())


def never_ends(*_: object, report: Progress) -> None:
    report("Finding the way into the plan", None)
    while True:
        time.sleep(60.0)


@pytest.mark.parametrize("step", ["make_take_up", "check_take_up"])
def test_what_is_computed_of_it_is_cancelled_at_once_and_its_process_ended(
    made: Made,
    lanes: tuple[Lane, Lane],
    runner: asyncio.Runner,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    step: str,
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        with pytest.raises(ConflictError, match="Nothing is being computed"):
            bench.desk.cancel_take_up()
        monkeypatch.setattr(take_up_desk, step, never_ends)
        lane = lanes[step == "check_take_up"]
        taking = asyncio.ensure_future(bench.desk.take_up(ME, TakeUpPlan(revision=3)))
        async with asyncio.timeout(60.0):
            while not (bench.desk.state.can_cancel and lane.running and lane._worker is not None):
                await asyncio.sleep(0.02)
        assert bench.told[-1].can_cancel
        worker = lane._worker
        assert worker is not None
        bench.desk.cancel_take_up()
        with pytest.raises(JobCancelledError, match="was cancelled") as refused:
            async with asyncio.timeout(60.0):
                await taking
        before = "The vehicle holds, and the mission before is still on board: Resume flies that."
        assert refused.value.advice.startswith("The vehicle holds")
        assert (refused.value.advice == before) is (step == "make_take_up")
        async with asyncio.timeout(60.0):
            while worker.alive():
                await asyncio.sleep(0.02)
        assert (bench.desk.state.busy, bench.desk.state.can_cancel) == ("", False)
        assert TakeUp not in map(type, bench.vehicle.told)
        monkeypatch.undo()
        state = await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert state.taken_up is not None, "and it can be tried again"

    runner.run(scenario())


def test_beside_other_vehicles_it_is_resumed_as_a_start_would_be(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    def row(state: str) -> CheckRow:
        return CheckRow.model_validate({"code": "others", "state": state, "text": f"Bee: {state}"})

    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        bench.desk.on_others(row("good"))  # of its start
        state = await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert state.taken_up is not None
        assert state.taken_up.others == PENDING
        bench.desk.on_flight(FlightStatus(way="auto", phase="paused"))
        bench.live.state = replace(bench.live.state, mission_item=1)
        assert bench.desk.waits_in_air
        for refused in (PENDING, row("bad"), row("unknown")):
            bench.desk.on_others(refused)
            with pytest.raises(CheckNeededError, match=refused.text):
                await bench.desk.resume(ME, ["others"])
        bench.desk.on_others(row("accept"))
        assert bench.told[-1].taken_up is not None
        assert bench.told[-1].taken_up.others == row("accept")
        with pytest.raises(CheckNeededError, match="Bee: accept"):
            await bench.desk.resume(ME, [])
        assert Resume not in map(type, bench.vehicle.told)
        await bench.desk.resume(ME, ["others"])
        assert isinstance(bench.vehicle.told[-1], Resume)
        bench.desk.on_flight(FlightStatus(way="auto", phase="flying"))
        bench.desk.on_others(row("bad"))
        assert not bench.desk.waits_in_air
        bench.live.state = replace(bench.live.state, mission_item=4)
        bench.desk.on_flight(FlightStatus(way="auto", phase="paused"))
        await bench.desk.resume(ME, [])  # of a flight that goes on the alarm in the air tells

    runner.run(scenario())


@pytest.mark.parametrize(("breaks_off", "words"), [("keeps", HOLDS), ("mixes", "3 items that are not the mission")])
def test_an_upload_that_breaks_off_says_what_is_on_board_now(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path, breaks_off: Any, words: str
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        bench.vehicle.breaks_off = breaks_off
        with pytest.raises(TransferError, match="broke off at item 3") as refused:
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert words in refused.value.advice
        assert ("Resume is refused" in refused.value.advice) == (breaks_off == "mixes")
        assert not [request for request in bench.vehicle.told if isinstance(request, TakeUp)]
        assert bench.desk.state.taken_up is None

        bench.vehicle.answers_no_download = True
        with pytest.raises(TransferError) as unknown:
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert "What is on board is not known (The vehicle does not answer)" in unknown.value.advice

    runner.run(scenario())


def px4_plan(bench: Bench) -> None:
    profile = bench.document.profile.model_copy(update={"firmware": "px4"})
    with_document(bench, profile=profile)


def another_vehicle(bench: Bench) -> None:
    with_document(bench, profile=bench.document.profile.model_copy(update={"name": "Large hexa"}))


def with_document(bench: Bench, **fields: Any) -> None:
    document = bench.document.model_copy(update=fields)
    bench.plan = bench.plan.model_copy(update={"document": document})


def another_model(bench: Bench) -> None:
    record = bench.aboard.record
    assert record is not None
    other = replace(record, terrain_sha256="0" * 64, terrain_name="Old hill")
    bench.aboard.read_back(onboard(other, len(bench.vehicle.items), ()))


def not_certified(bench: Bench) -> None:
    result = bench.plan.computation.result
    assert result is not None
    answer = bench.plan.computation.model_copy(update={"result": result.model_copy(update={"certified": False})})
    bench.plan = bench.plan.model_copy(update={"computation": answer})


def still_computing(bench: Bench) -> None:
    answer = bench.plan.computation.model_copy(update={"state": "computing", "result": None})
    bench.plan = bench.plan.model_copy(update={"computation": answer})


def changed_since(bench: Bench) -> None:
    bench.plan = bench.plan.model_copy(update={"revision": 4})


def nearly_empty(bench: Bench) -> None:
    bench.live.state = replace(bench.live.state, battery_share=0.04)


def without_a_battery_figure(bench: Bench) -> None:
    bench.live.state = replace(bench.live.state, battery_share=None)


def low_return(bench: Bench) -> None:
    bench.vehicle.parameters = {"RTL_ALT": 200.0}


def poor_reception(bench: Bench) -> None:
    bench.live.state = replace(bench.live.state, gnss_fix="none")


def fenced_out(bench: Bench) -> None:
    state = bench.live.state
    shape = circle(state.lat_deg, state.lon_deg, 4.0, inclusion=False, where="t")
    bench.vehicle.places["fence"] = wire_items(fence_items(Fence(circles=(shape,))))


@pytest.mark.parametrize(
    ("mishap", "error", "words"),
    [
        (px4_plan, NotAllowedError, "made for PX4, the vehicle flies ArduPilot"),
        (another_vehicle, NotAllowedError, 'made for "Large hexa", the vehicle flies as'),
        (another_model, NotAllowedError, 'the vehicle took off over "Old hill"'),
        (not_certified, NotCertifiedError, "not certified"),
        (still_computing, NotReadyError, "no finished plan"),
        (changed_since, StaleRevisionError, "has changed meanwhile"),
        (nearly_empty, NotAllowedError, "battery: The battery has 4 %; the flight needs"),
        (without_a_battery_figure, NotAllowedError, "does not tell how much battery is left"),
        (low_return, NotAllowedError, "not certified"),
        (poor_reception, NotAllowedError, "GNSS"),
        (fenced_out, NotAllowedError, "fence"),
    ],
)
def test_what_is_in_the_way_is_said_and_nothing_is_sent(
    made: Made,
    lanes: tuple[Lane, Lane],
    runner: asyncio.Runner,
    tmp_path: Path,
    mishap: Callable[[Bench], None],
    error: type[Exception],
    words: str,
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        before = bench.vehicle.items
        mishap(bench)
        with pytest.raises(error) as refused:
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert words in str(refused.value)
        assert HOLDS in str(refused.value)
        assert [type(request) for request in bench.vehicle.told] == [Pause]
        assert bench.vehicle.items == before
        assert bench.desk.state.busy == ""

    runner.run(scenario())


def test_a_battery_that_is_not_told_can_be_accepted(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes, battery_share=None)
        state = await bench.desk.take_up(ME, TakeUpPlan(revision=3, accept=["battery"]))
        assert state.taken_up is not None
        assert state.taken_up.battery.state == "accept"

    runner.run(scenario())


def test_one_that_is_computed_for_too_long_is_given_up_and_the_next_one_is_made(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        with monkeypatch.context() as hurried:
            hurried.setattr("server.flying.in_flight.take_up_desk.FOUND_WITHIN_S", 0.0)
            with pytest.raises(NotReadyError, match="No way into the plan was found within 0 s") as refused:
                await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert HOLDS in refused.value.advice
        assert bench.desk.state.busy == ""
        assert (await bench.desk.take_up(ME, TakeUpPlan(revision=3))).taken_up is not None
        assert "Finding the way into the plan" in {state.busy for state in bench.told}

    runner.run(scenario())


@pytest.mark.parametrize(
    ("over_ground_m", "words"), [(5.0, "5.0 m above the ground"), (-3.0, "3.0 m below the ground")]
)
def test_a_home_that_was_moved_off_the_ground_is_not_counted_from(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path, over_ground_m: float, words: str
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        there = made.standing(east_m=6.0)
        assert there.home_alt_amsl_m is not None
        bench.live.state = with_home(bench.live.state, there, there.home_alt_amsl_m + over_ground_m)
        with pytest.raises(NotAllowedError, match="moved in flight to a height") as refused:
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert words in refused.value.what
        assert HOLDS in refused.value.advice

    runner.run(scenario())


def with_home(state: VehicleState, there: VehicleState, alt_amsl_m: float) -> VehicleState:
    return replace(state, home_lat_deg=there.lat_deg, home_lon_deg=there.lon_deg, home_alt_amsl_m=alt_amsl_m)


def test_a_home_that_was_moved_to_where_something_stands_is_not_certified(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes)
        there = beside_something(made)
        assert there.home_alt_amsl_m is not None
        bench.live.state = with_home(bench.live.state, there, there.home_alt_amsl_m)
        with pytest.raises(NotAllowedError, match="not certified") as refused:
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert "home" in str(refused.value)
        assert HOLDS in refused.value.advice

    runner.run(scenario())


def beside_something(made: Made) -> VehicleState:
    """Below the highest step of the demo's model: no vehicle can stand there."""
    dsm = made.library.load_terrain(made.library.terrains()[0].id)
    steps_m = np.abs(np.diff(dsm.elevation_m, axis=1))
    row, column = np.unravel_index(int(np.nanargmax(steps_m)), steps_m.shape)
    assert steps_m[row, column] > 2.0
    x_m, y_m = dsm.transform @ (float(column) + 0.5, float(row) + 0.5)
    east_m, north_m = np.array([x_m, y_m]) - dsm.xy_from_lat_lon(np.array([made.home]))[0]
    return made.standing(east_m=float(east_m), north_m=float(north_m))


def test_one_that_does_not_come_to_rest_or_stands_on_the_ground_is_refused(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = await flown(made, tmp_path, lanes, ground_speed_m_s=4.0)
        monkeypatch.setattr("server.flying.in_flight.take_up_desk.HOLDS_WITHIN_S", 0.3)
        with pytest.raises(SilentError, match="does not stand still") as moves:
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert "does not stand still yet, and the mission before is still on board" in moves.value.advice
        bench.live.state = replace(bench.live.state, mode="AUTO")
        with pytest.raises(SilentError) as flies:
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert "The vehicle does not hold: it is in AUTO" in flies.value.advice
        bench.live.state = made.standing()
        with pytest.raises(NotAllowedError, match="not in the air"):
            await bench.desk.take_up(ME, TakeUpPlan(revision=3))
        assert [type(request) for request in bench.vehicle.told] == [Pause, Pause]

    runner.run(scenario())
