"""The flight desk over a vehicle that keeps missions as ArduPilot does: upload, check, moved heights, start, resume."""

from __future__ import annotations

import asyncio
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from planning.formats.wpl import read_wpl
from server.errors import CheckNeededError, ConflictError, NotCertifiedError, NotReadyError, StaleRevisionError
from server.flying.apart.other_vehicles import PENDING
from server.schemas import CheckRow, FenceCircleDoc, FenceDoc, PlaceDoc, StartFlight
from server.work.jobs import Lane
from telemetry.errors import MissionUnknownError, NotAllowedError, NoVehicleError, TransferError
from telemetry.topics.messages import FlightStatus, LinkStatus
from telemetry.topics.obstacles import AvoidanceStatus, Eye
from telemetry.topics.requests import Arm, ReadParameters, StartAuto, StartGuided
from tests.server.flying_desk_bench import ME, QUAD, Bench, Made

pytestmark = pytest.mark.xdist_group("flying-desk")


def test_a_flight_from_upload_to_start(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        uploaded = (await bench.desk.upload(ME, 3)).onboard
        assert (uploaded.state, uploaded.plan_name, uploaded.is_open_plan) == ("verified", "Demo flight", True)
        assert uploaded.items == len(bench.vehicle.items) > 5
        assert "whole centimetres" in uploaded.rounded_note
        with pytest.raises(CheckNeededError, match="not been checked"):
            await bench.desk.start(ME, StartFlight(digest=uploaded.digest or ""))
        checked = (await bench.desk.check(ME)).preflight
        assert checked is not None
        assert checked.ok
        assert [row.code for row in checked.rows if row.state != "good"] == []
        assert checked.min_distance_m is not None
        assert checked.min_distance_m > 3.3
        await bench.desk.start(ME, StartFlight(digest=uploaded.digest or ""))
        assert bench.vehicle.told == [StartAuto(ME, uploaded.digest or "")]
        assert bench.records[-1].digest == uploaded.digest
        assert '"certified": true' in bench.records[-1].certificate_json
        assert read_wpl(bench.records[-1].mission_wpl).items
        assert {state.busy for state in bench.told} >= {"Uploading", "Checking the start", "Starting", ""}

        bench.desk.on_flight(FlightStatus(phase="interrupted", broke_off_at=9))
        assert bench.desk.state.resume_from_item == 9
        await bench.desk.start(ME, StartFlight(digest=uploaded.digest or "", from_item=9))
        resumed = bench.vehicle.told[-1]
        assert isinstance(resumed, StartAuto)
        assert resumed.from_item >= 9
        assert resumed.climb_to_m is not None
        assert resumed.climb_to_m > 5.0

        await bench.desk.start(ME, StartFlight(digest=uploaded.digest or "", way="guided"))
        script = bench.vehicle.told[-1]
        assert isinstance(script, StartGuided)
        assert len(script.targets) > 5
        assert script.targets[-1].t_s is not None
        proof = json.loads(bench.records[-1].certificate_json)
        assert script.spare_m is not None
        # What handing over needs is never less than what the plan's own way of flying does.
        assert 0.0 < script.spare_m <= proof["min_distance_m"] - proof["required_clearance_m"]

        bench.desk.on_disarmed()
        assert bench.desk.state.preflight is None
        with pytest.raises(CheckNeededError, match="not been checked"):
            await bench.desk.start(ME, StartFlight(digest=uploaded.digest or ""))

        again = Bench(made, tmp_path / "onboard.json", lanes)
        again.desk.on_link(LinkStatus(0.0, mission_state="verified", mission_digest=uploaded.digest))
        assert again.desk.state.onboard.plan_name == "Demo flight"
        again.desk.on_link(LinkStatus(0.0, mission_state="verified", mission_digest="another"))
        assert (again.desk.state.onboard.plan_name, again.desk.state.onboard.state) == ("", "verified")

    runner.run(scenario())


def test_what_is_proved_for_auto_only_is_not_handed_over_one_at_a_time(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    """5.6 m are kept: enough for AUTO with 2.9 m of position error, 0.1 m too little for GUIDED."""

    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        profile = made.document.profile.model_copy(update={"position_error_m": 2.9})
        bench.plan = bench.plan.model_copy(update={"document": made.document.model_copy(update={"profile": profile})})
        digest_ = await bench.ready()
        with pytest.raises(NotAllowedError, match=r"one at a time it needs 5\.72 m") as caught:
            await bench.desk.start(ME, StartFlight(digest=digest_, way="guided"))
        assert "fly in AUTO" in caught.value.advice
        assert bench.vehicle.told == []
        await bench.desk.start(ME, StartFlight(digest=digest_))

    runner.run(scenario())


def test_another_home_moves_the_heights(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        before = (await bench.desk.upload(ME, 3)).onboard.digest
        bench.live.state = made.standing(north_m=14.0)
        state = await bench.desk.check(ME)
        assert state.preflight is not None
        assert state.preflight.rereferenced
        assert state.preflight.home_shift_m is not None
        assert abs(state.preflight.home_shift_m) > 0.3
        assert state.onboard.digest != before
        assert state.onboard.is_open_plan
        moved, planned = read_wpl(bench.records[-1].mission_wpl), read_wpl(bench.records[0].mission_wpl)
        lower_m = planned.items[-2].alt_m - moved.items[-2].alt_m
        assert lower_m == pytest.approx(state.preflight.home_shift_m, abs=0.02)
        bench.desk.on_parameters()
        await bench.desk.check(ME)  # the mission counts from here by now, the plan does not
        assert bench.desk.home_rises_m == pytest.approx(state.preflight.home_shift_m, abs=0.1)
        row = next(row for row in state.preflight.rows if row.code == "home")
        assert row.state == "good"
        assert "heights were moved" in row.text
        await bench.desk.start(ME, StartFlight(digest=state.onboard.digest or ""))
        bench.live.state = made.standing(north_m=20.0)
        with pytest.raises(CheckNeededError, match="was moved"):
            await bench.desk.start(ME, StartFlight(digest=state.onboard.digest or ""))

    runner.run(scenario())


def test_a_check_holds_for_one_vehicle_one_mission_and_one_place(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    def status(digest_: str, **changes: Any) -> LinkStatus:
        now = LinkStatus(time.monotonic(), adopted=QUAD, mission_state="verified", mission_digest=digest_)
        return replace(now, **changes)

    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        digest_ = await bench.ready()
        bench.desk.on_link(status(digest_))
        bench.desk.on_link(LinkStatus(0.0, mission_state="unknown"))
        assert bench.desk.state.preflight is not None, "a status from before the check takes nothing back"
        others: list[dict[str, Any]] = [
            {"adopted": replace(QUAD, id="udp/2/1", system_id=2)},
            {"mission_state": "unknown"},
            {"mission_digest": "another"},
        ]
        for changes in others:
            bench.desk.on_link(status(digest_))
            await bench.desk.check(ME)
            bench.desk.on_link(status(digest_, **changes))
            assert bench.desk.state.preflight is None
        bench.desk.on_link(status(digest_))
        await bench.desk.check(ME)
        # Its home is where it took off last; what counts is where it stands.
        bench.live.state = replace(made.standing(), lat_deg=made.home[0] + 1e-4)
        with pytest.raises(CheckNeededError, match="was moved"):
            await bench.desk.start(ME, StartFlight(digest=digest_))
        bench.live.state = replace(made.standing(), autopilot="px4")
        with pytest.raises(NotAllowedError, match="made for ArduPilot"):
            await bench.desk.check(ME)

    runner.run(scenario())


def test_what_must_be_accepted_is_not_flown_without(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        bench.live.state = replace(made.standing(), gnss_fix="3d", horizontal_accuracy_m=9.0)
        digest_ = (await bench.desk.upload(ME, 3)).onboard.digest or ""
        state = await bench.desk.check(ME)
        assert state.preflight is not None
        assert [row.code for row in state.preflight.rows if row.state == "accept"] == ["gnss"]
        with pytest.raises(CheckNeededError, match="GNSS"):
            await bench.desk.start(ME, StartFlight(digest=digest_))
        await bench.desk.start(ME, StartFlight(digest=digest_, accept=["gnss"]))
        bench.live.state = replace(made.standing(), gnss_fix="no_fix")
        await bench.desk.check(ME)
        with pytest.raises(CheckNeededError, match="no fix"):
            await bench.desk.start(ME, StartFlight(digest=digest_, accept=["gnss", "battery", "rtl_height"]))

    runner.run(scenario())


def test_avoidance_without_eyes_is_flown_only_by_who_says_without(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    def row_of(bench: Bench) -> CheckRow:
        assert bench.desk.state.preflight is not None
        return next(row for row in bench.desk.state.preflight.rows if row.code == "avoidance")

    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        start = StartFlight(digest=await bench.ready())
        assert row_of(bench).text.startswith("Avoidance is off")
        bench.watch.avoidance = AvoidanceStatus(enabled=True, state="blind")
        bench.desk.refresh()
        assert row_of(bench).state == "accept"
        shown = bench.told[-1].preflight
        assert shown is not None
        assert shown.rows[-1] == row_of(bench)
        with pytest.raises(CheckNeededError, match="no sensor sees ahead"):
            await bench.desk.start(ME, start)
        bench.watch.avoidance = replace(bench.watch.avoidance, state="watching", eyes=(Eye("radar", 1.0, 30.0, 9.0),))
        assert row_of(bench).state == "good"
        await bench.desk.start(ME, start)
        bench.watch.avoidance = replace(bench.watch.avoidance, state="blind", eyes=())
        await bench.desk.start(ME, start.model_copy(update={"accept": ["avoidance"]}))

    runner.run(scenario())


def test_beside_other_vehicles_nobody_starts_before_it_is_told_what_they_do(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    def row(state: str, text: str) -> CheckRow:
        return CheckRow.model_validate({"code": "others", "state": state, "text": text})

    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes, is_alone=False)
        await bench.desk.upload(ME, 3)
        state = await bench.desk.check(ME)
        assert state.preflight is not None
        assert [row for row in state.preflight.rows if row.state != "good"] == [PENDING]
        start = StartFlight(digest=state.onboard.digest or "")
        willing = start.model_copy(update={"accept": ["others"]})
        with pytest.raises(CheckNeededError, match="not known yet"):
            await bench.desk.start(ME, willing)
        bench.desk.on_others(row("bad", "It may come within 1 m of Bee."))
        assert bench.told[-1].preflight is not None
        assert bench.told[-1].preflight.rows[-1].text == "It may come within 1 m of Bee."
        with pytest.raises(CheckNeededError, match="within 1 m of Bee"):
            await bench.desk.start(ME, willing)
        bench.desk.on_others(row("accept", "Bee has such a mission, too."))
        with pytest.raises(CheckNeededError, match="such a mission"):
            await bench.desk.start(ME, start)
        await bench.desk.start(ME, willing)

    runner.run(scenario())


def test_what_is_not_ready_is_not_uploaded(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        with pytest.raises(StaleRevisionError):
            await bench.desk.upload(ME, 2)
        bench.plan = made.plan(state="running")
        with pytest.raises(NotReadyError):
            await bench.desk.upload(ME, 3)
        result = made.computation.result
        assert result is not None
        bench.plan = made.plan(result=result.model_copy(update={"certified": False}))
        with pytest.raises(NotCertifiedError):
            await bench.desk.upload(ME, 3)
        assert bench.vehicle.items == ()
        assert bench.desk.state.busy == ""

    runner.run(scenario())


def test_a_vehicle_that_keeps_another_mission_is_not_started(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        bench.vehicle.swaps_two_items = True
        with pytest.raises(TransferError, match="does not hold the mission"):
            await bench.desk.upload(ME, 3)
        with pytest.raises(MissionUnknownError):
            await bench.desk.check(ME)
        bench.vehicle.swaps_two_items = False
        digest_ = await bench.ready()
        bench.vehicle.items = bench.vehicle.items[:-1]
        with pytest.raises(MissionUnknownError):
            await bench.desk.check(ME)
        with pytest.raises(CheckNeededError):
            await bench.desk.start(ME, StartFlight(digest=digest_))
        assert bench.vehicle.told == []

    runner.run(scenario())


def test_one_thing_at_a_time_but_commands_always(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        first = asyncio.create_task(bench.desk.upload(ME, 3))
        while not bench.desk.state.busy:
            await asyncio.sleep(0)
        with pytest.raises(ConflictError, match="Uploading"):
            await bench.desk.check(ME)
        await bench.desk.command(Arm(ME))
        assert bench.vehicle.told == [Arm(ME)]
        await first
        bench.live.state = None
        with pytest.raises(NoVehicleError):
            await bench.desk.check(ME)

    runner.run(scenario())


def test_what_the_link_said_before_the_read_back_is_not_believed_after_it(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        waiting = LinkStatus(time.monotonic(), adopted=QUAD, state="live", mission_state="unknown")
        assert (await bench.desk.upload(ME, 3)).onboard.is_open_plan
        bench.desk.on_link(waiting)
        assert bench.desk.state.onboard.is_open_plan
        assert bench.aboard.record is not None
        bench.desk.on_link(replace(waiting, t_mono_s=time.monotonic()))
        assert bench.desk.state.onboard.state == "unknown"

    runner.run(scenario())


def test_a_plan_takes_its_fence_along_and_the_next_one_without_takes_it_away(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    lat_deg, lon_deg = made.home
    fence = FenceDoc(
        circles=[
            FenceCircleDoc(id="c", inclusion=True, centre=PlaceDoc(lat_deg=lat_deg, lon_deg=lon_deg), radius_m=900.0)
        ]
    )
    fenced = made.document.model_copy(update={"fence": fence})

    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        bench.vehicle.parameters |= {"FENCE_ENABLE": 1.0, "FENCE_ACTION": 1.0, "FENCE_TYPE": 4.0}
        bench.plan = bench.plan.model_copy(update={"document": fenced})
        bench.vehicle.drops_fences = True
        with pytest.raises(TransferError, match="does not hold the fence that was sent"):
            await bench.desk.upload(ME, 3)
        assert bench.vehicle.items == ()
        bench.vehicle.drops_fences = False
        await bench.desk.upload(ME, 3)
        assert len(bench.vehicle.places["fence"]) == 1
        state = await bench.desk.check(ME)
        assert state.preflight is not None
        assert {row.code: row.state for row in state.preflight.rows}["fence"] == "good"
        assert "returns" in state.at_fence
        bench.desk.on_parameters()
        assert (bench.desk.state.preflight, bench.desk.state.at_fence) == (None, "")

        assert "returns" in (await bench.desk.check(ME)).at_fence
        other = replace(QUAD, id="udp/2/1", system_id=2)
        for adopted in (other, QUAD):
            bench.desk.on_link(LinkStatus(time.monotonic(), adopted=adopted, state="live"))
            assert bench.desk.state.at_fence == ""

        held, bench.vehicle.places["fence"] = bench.vehicle.places["fence"], ()
        state = await bench.desk.check(ME)
        assert state.preflight is not None
        assert {row.code: row.state for row in state.preflight.rows}["fence"] == "bad"
        assert not state.preflight.ok

        bench.vehicle.places["fence"] = held
        bench.plan = bench.plan.model_copy(update={"document": made.document})
        await bench.desk.upload(ME, 3)
        assert bench.vehicle.places["fence"] == ()
        foreign = replace(held[0], lat_deg=held[0].lat_deg + 0.001)
        bench.vehicle.places["fence"] = (foreign,)
        await bench.desk.upload(ME, 3)
        assert bench.vehicle.places["fence"] == (foreign,)

    runner.run(scenario())


def test_parameters_that_are_written_during_the_check_make_it_void(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        await bench.desk.upload(ME, 3)
        answered = bench.vehicle.call

        async def call(request: Any) -> Any:
            answer = await answered(request)
            if isinstance(request, ReadParameters):
                bench.desk.on_parameters()
            return answer

        monkeypatch.setattr(bench.vehicle, "call", call)
        with pytest.raises(CheckNeededError, match="written during the check"):
            await bench.desk.check(ME)
        assert bench.desk.state.preflight is None

    runner.run(scenario())
