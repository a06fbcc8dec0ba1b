"""Plans that are taken up one after the other in one flight, and tries that fail on the way."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from planning.fence.fence_model import Fence, circle
from planning.formats.fence_items import fence_items
from server.errors import ConflictError, JobCancelledError, NotReadyError, StorageError
from server.flying.in_flight.take_up_desk import TakingUp
from server.schemas import FenceDoc, RallyDoc, TakeUpPlan
from server.work.jobs import Lane
from telemetry.errors import NotAllowedError, TransferError
from telemetry.flight.home_watch import home_of
from telemetry.mavlink.items import wire_items
from telemetry.mavlink.verify import as_stored
from telemetry.topics.messages import FlightStatus, LinkStatus
from telemetry.topics.onboard_lists import Item
from telemetry.topics.requests import Pause, TakeUp
from tests.server.flying_desk_bench import ME, QUAD, Bench, Made
from tests.server.test_take_up_desk import HOLDS, another_vehicle, flown, hovering, px4_plan, with_document

pytestmark = pytest.mark.xdist_group("flying-desk")
Scenario = Callable[[Bench], Awaitable[None]]
Play = Callable[[Scenario], None]
AGAIN = TakeUpPlan(revision=3)


@pytest.fixture
def play(made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path) -> Play:
    def played(scenario: Scenario) -> None:
        async def whole() -> None:
            await scenario(await flown(made, tmp_path, lanes))

        runner.run(whole())

    return played


def test_after_a_try_that_failed_the_flight_is_still_the_one_that_was_started(play: Play) -> None:
    async def scenario(bench: Bench) -> None:
        bench.vehicle.breaks_off = "mixes"
        with pytest.raises(TransferError):
            await bench.desk.take_up(ME, AGAIN)
        mixed = LinkStatus(time.monotonic() + 1.0, adopted=QUAD, mission_state="verified", mission_digest="mixed")
        bench.desk.on_link(mixed)
        bench.desk.on_flight(FlightStatus(way="auto", phase="paused"))
        own = bench.plan
        for mishap, words in ((px4_plan, "made for PX4"), (another_vehicle, "flies as")):
            mishap(bench)
            with pytest.raises(NotAllowedError) as refused:
                await bench.desk.take_up(ME, AGAIN)
            assert words in refused.value.what
            assert "3 items that are not the mission before" in refused.value.advice
            assert "Resume is refused" in refused.value.advice
            bench.plan = own
        bench.vehicle.breaks_off = ""
        assert (await bench.desk.take_up(ME, AGAIN)).taken_up is not None
        another_vehicle(bench)
        with pytest.raises(NotAllowedError, match="flies as") as after:
            await bench.desk.take_up(ME, AGAIN)
        assert HOLDS in after.value.advice, "what was taken up is what Resume flies"

    play(scenario)


def test_after_a_guided_way_nothing_is_said_of_a_resume(play: Play) -> None:
    async def scenario(bench: Bench) -> None:
        bench.live.flight = FlightStatus(way="guided", phase="paused", is_flown=True)
        px4_plan(bench)
        with pytest.raises(NotAllowedError) as refused:
            await bench.desk.take_up(ME, AGAIN)
        assert refused.value.advice.endswith("The vehicle holds, and the mission before is still on board.")

    play(scenario)


def test_what_was_flown_is_left_out_of_the_second_plan_as_well(play: Play) -> None:
    async def scenario(bench: Bench) -> None:
        await bench.desk.take_up(ME, AGAIN)
        first = bench.aboard.record
        assert first is not None
        at = first.way_items + 3
        then = next(item for item in bench.vehicle.items[at - 1 :] if item.command == 16)
        place: dict[str, Any] = {"lat_deg": then.lat_deg, "lon_deg": then.lon_deg, "alt_rel_home_m": then.alt_m}
        bench.live.state = replace(hovering(bench.made), mission_item=at, **place)
        await bench.desk.take_up(ME, AGAIN)
        second = bench.aboard.record
        assert second is not None
        assert second.passed_flown >= first.passed_flown + 1, "of the plan, through two ways into it"
        assert second.passed_wpl.startswith(first.passed_wpl.rstrip()[:200])

    play(scenario)


def test_rally_points_that_were_sent_before_the_mission_failed_are_said(play: Play) -> None:
    async def scenario(bench: Bench) -> None:
        home_lat_deg, home_lon_deg = bench.made.home
        with_document(bench, rally=[RallyDoc(id="r", lat_deg=home_lat_deg, lon_deg=home_lon_deg, alt_rel_home_m=60.0)])
        bench.vehicle.breaks_off = "keeps"
        with pytest.raises(TransferError) as refused:
            await bench.desk.take_up(ME, AGAIN)
        assert "fence or rally points of the new plan were sent" in refused.value.advice
        assert "Resume is refused" in refused.value.advice

    play(scenario)


def fence_of(bench: Bench, radius_m: float) -> tuple[Item, ...]:
    home_lat_deg, home_lon_deg = bench.made.home
    return wire_items(
        fence_items(Fence(circles=(circle(home_lat_deg, home_lon_deg, radius_m, inclusion=True, where="t"),)))
    )


def with_fence(bench: Bench, radius_m: float) -> None:
    home_lat_deg, home_lon_deg = bench.made.home
    round_home = {
        "id": "c",
        "centre": {"lat_deg": home_lat_deg, "lon_deg": home_lon_deg},
        "radius_m": radius_m,
        "inclusion": True,
    }
    with_document(bench, fence=FenceDoc.model_validate({"circles": [round_home]}))


@pytest.mark.parametrize("crews_own", [False, True])
def test_a_fence_that_a_failed_try_sent_does_not_stay_for_a_plan_without_one(play: Play, *, crews_own: bool) -> None:
    """What was on board before that try counts again: nothing, or a fence that is no plan's."""

    async def scenario(bench: Bench) -> None:
        before = fence_of(bench, 900.0) if crews_own else ()
        bench.vehicle.places["fence"] = before
        without = bench.document
        with_fence(bench, 700.0)
        bench.vehicle.breaks_off = "keeps"
        with pytest.raises(TransferError):
            await bench.desk.take_up(ME, AGAIN)
        assert len(bench.vehicle.places["fence"]) == 1
        assert bench.vehicle.places["fence"] != before
        bench.vehicle.breaks_off = ""
        bench.plan = bench.plan.model_copy(update={"document": without})
        state = await bench.desk.take_up(ME, AGAIN)
        assert bench.vehicle.places["fence"] == as_stored(before, "ardupilot")
        assert state.taken_up is not None
        said = "is sent again, and counts" if crews_own else "The plan has no fence: what was on board is cleared."
        assert said in " ".join(state.taken_up.notes)

    play(scenario)


def test_a_fence_that_is_no_plans_stays_and_that_is_said(play: Play) -> None:
    async def scenario(bench: Bench) -> None:
        bench.vehicle.places["fence"] = kept = fence_of(bench, 900.0)
        state = await bench.desk.take_up(ME, AGAIN)
        assert bench.vehicle.places["fence"] == kept
        assert state.taken_up is not None
        assert "The plan has no fence: what is on board stays, and counts." in state.taken_up.notes

    play(scenario)


def test_an_upload_after_the_landing_clears_the_fence_of_a_try_that_failed(play: Play) -> None:
    async def scenario(bench: Bench) -> None:
        without = bench.document
        with_fence(bench, 700.0)
        bench.vehicle.breaks_off = "keeps"
        with pytest.raises(TransferError):
            await bench.desk.take_up(ME, AGAIN)
        bench.live.state = bench.made.standing()
        bench.desk.on_disarmed()
        bench.plan = bench.plan.model_copy(update={"document": without})
        await bench.desk.upload(ME, 3)
        assert bench.vehicle.places["fence"] == ()

    play(scenario)


def test_what_cannot_be_written_down_is_not_taken_up(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario(bench: Bench) -> None:
        saves = iter((None, StorageError("The disk is full.")))

        def save() -> None:
            if (error := next(saves)) is not None:
                raise error

        monkeypatch.setattr(bench.aboard, "save", save)
        with pytest.raises(StorageError, match="disk is full") as refused:
            await bench.desk.take_up(ME, AGAIN)
        assert "they are not taken up: Resume is refused" in refused.value.advice
        assert not [request for request in bench.vehicle.told if isinstance(request, TakeUp)]

    play(scenario)


def test_what_is_seen_during_the_upload_counts(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario(bench: Bench) -> None:
        looked: list[int] = []

        async def maps(_: Any) -> tuple[Any, ...]:
            looked.append(len([request for request in bench.vehicle.told if isinstance(request, Pause)]))
            return ()

        monkeypatch.setattr("server.flying.in_flight.take_up_desk.seen_maps", maps)
        await bench.desk.take_up(ME, AGAIN)
        assert looked == [1, 1], "before it is made, and when it was read back"

    play(scenario)


def desk() -> TakingUp:
    """Of which only what is computed is looked at."""
    nothing: Any = None
    return TakingUp(nothing, nothing, nothing, nothing, nothing, nothing, nothing)


def test_a_cancel_that_comes_with_the_answer_is_kept_and_one_that_comes_twice_does_nothing() -> None:
    async def scenario() -> None:
        taking = desk()

        async def is_done() -> None:
            async with taking.computing():
                taking.cancel()  # the answer is here already: nothing is awaited any more
                taking.cancel()

        with pytest.raises(JobCancelledError):
            await is_done()
        unwinding = asyncio.Event()

        async def computes() -> None:
            async with taking.computing():
                try:
                    await asyncio.Event().wait()
                finally:
                    unwinding.set()
                    await asyncio.sleep(0)

        computing = asyncio.ensure_future(computes())
        await asyncio.sleep(0)
        taking.cancel()
        await unwinding.wait()
        taking.cancel()
        with pytest.raises(JobCancelledError):
            await computing
        with pytest.raises(ConflictError, match="Nothing is being computed"):
            taking.cancel()
        async with taking.computing():
            pass  # the next try knows nothing of it

    asyncio.run(scenario())


def test_somebody_elses_time_limit_is_not_told_as_a_cancel() -> None:
    async def scenario() -> None:
        taking = desk()
        with pytest.raises(TimeoutError, match="of the bus"):
            async with taking.computing():
                raise TimeoutError("of the bus")
        assert not taking.is_computing

    asyncio.run(scenario())


def test_what_is_on_board_is_not_taken_up_for_a_home_that_nobody_told(
    play: Play, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario(bench: Bench) -> None:
        certifies = TakingUp.certificate

        async def loses_home(taking: TakingUp, *args: Any) -> Any:
            assert bench.live.state is not None
            bench.live.state = replace(bench.live.state, home_alt_amsl_m=None)
            return await certifies(taking, *args)

        monkeypatch.setattr(TakingUp, "certificate", loses_home)
        with pytest.raises(NotReadyError, match="does not tell its home whole"):
            await bench.desk.take_up(ME, AGAIN)
        assert TakeUp not in map(type, bench.vehicle.told)

    play(scenario)


def test_what_the_link_says_meanwhile_does_not_take_away_the_home_that_was_certified(
    play: Play, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario(bench: Bench) -> None:
        notes = bench.desk._uploads.note

        async def noted() -> None:
            bench.desk._taking_up.forget()  # as where another vehicle is adopted, or the mission is flown
            await notes()

        monkeypatch.setattr(bench.desk._uploads, "note", noted)
        await bench.desk.take_up(ME, AGAIN)
        (sent,) = [request for request in bench.vehicle.told if isinstance(request, TakeUp)]
        assert sent.home is not None
        assert sent.home == home_of(bench.live.state)

    play(scenario)
