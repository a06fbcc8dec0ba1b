"""Guided ways at the desk: judged over the open model with what is on board, flown only where that was certified."""

from __future__ import annotations

import asyncio
import math
import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from planning.errors import ParameterError
from planning.fence.fence_model import Fence, circle
from planning.formats.fence_items import fence_items
from server.errors import CheckNeededError, ConflictError, NotCertifiedError, NotFoundError, NotReadyError
from server.flying.apart.nearness import Flown
from server.flying.in_flight.judged_way import flown_places
from server.flying.in_flight.way_task import WayJudged, wish_of
from server.heard.channel import ShownWay
from server.schemas import FenceDoc, FlyWayBody, GuidedState, PlaceDoc, WayBody, WaySpeedBody
from server.schemas.flight_docs import CHECK_FRESH_S
from server.work.jobs import Lane
from telemetry.errors import NotAllowedError, NoVehicleError
from telemetry.mavlink.items import wire_items
from telemetry.topics.messages import FlightStatus
from telemetry.topics.requests import FlyWay, SetSpeed, StartGuided
from telemetry.topics.vehicle import VehicleState
from tests.server.flying_desk_bench import ME, Made
from tests.server.in_flight_benches import WayBench

pytestmark = pytest.mark.xdist_group("flying-desk")


def test_a_way_is_judged_shown_and_flown_from_where_the_vehicle_hovers(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        way = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        assert way.problem is None
        assert way.clearance_m is not None
        assert way.clearance_m >= way.required_m > 1.0
        assert (way.flies, way.lands, way.has_seen) == (False, False, False)
        assert [state.is_judging for state in bench.told] == [True, False]
        shown = bench.live.way
        assert isinstance(shown, ShownWay)
        assert shown.is_certified

        with pytest.raises(NotFoundError, match="Nothing is judged any more"):
            await bench.fly(FlyWayBody(id="another"))
        vehicle: Any = bench.vehicle
        call = vehicle.call

        async def call_while_it_is_put_away(request: Any) -> Any:
            assert bench.desk.drop().way is not None, "what is being ordered is not put away"
            return await call(request)

        vehicle.call = call_while_it_is_put_away
        await bench.fly(FlyWayBody(id=way.id))
        vehicle.call = call
        request = bench.vehicle.told[-1]
        assert isinstance(request, FlyWay)
        assert request.most_m_s == bench.document.profile.max_speed_m_s
        last = request.targets[-1]
        assert (last.lat_deg, last.lon_deg, last.alt_rel_home_m) == shown.places[-1]
        assert bench.told[-1].way == way.model_copy(update={"flies": True})
        with pytest.raises(ConflictError, match="being flown"):
            await bench.judged(action="home")
        assert bench.desk.drop().way is not None, "what is flown stays on show"
        bench.live.flight = FlightStatus("guided", "paused")
        with pytest.raises(ParameterError):
            await bench.judged(action="to")
        assert bench.desk.state.way is not None, "it can still be gone on with"
        bench.live.flight = FlightStatus("guided", "flying")

        await bench.desk.set_speed(ME, WaySpeedBody(speed_m_s=1.5))
        assert bench.vehicle.told[-1] == SetSpeed(ME, 1.5)
        bench.desk.on_flight(FlightStatus("guided", "paused", since_utc_s=time.time() - 3600, is_flown=True))
        assert bench.desk.state.way is not None, "of a flight before"
        bench.desk.on_flight(FlightStatus("guided", "flying", since_utc_s=time.time() + 1))
        assert bench.desk.state.way is not None
        bench.desk.on_flight(FlightStatus("guided", "paused", since_utc_s=time.time() + 1, is_flown=True))
        assert bench.desk.state == GuidedState()
        assert bench.live.way is None

    runner.run(scenario())


def test_what_is_not_certified_is_shown_and_not_flown(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        centre = bench.beside(40.0, 0.0)
        fence = Fence(circles=(circle(centre.lat_deg, centre.lon_deg, 10.0, inclusion=False, where="t"),))
        bench.vehicle.places["fence"] = wire_items(fence_items(fence))
        way = await bench.judged(action="to", place=centre, height_m=20.0)
        assert way.problem == "way"
        assert "fence" in way.reasons[0].text
        assert bench.live.way is not None
        assert not bench.live.way.is_certified
        for accepts in (False, True):
            with pytest.raises(NotCertifiedError, match="fence"):
                await bench.fly(FlyWayBody(id=way.id, accept_return=accepts))

    runner.run(scenario())


def test_the_plans_own_ceiling_holds_although_no_vehicle_keeps_it(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        ceiling = FenceDoc(ceiling_rel_home_m=100.0)
        bench.document = bench.document.model_copy(update={"fence": ceiling})
        assert (await bench.judged(action="height", height_m=20.0)).problem is None
        bench.hovers(made.standing(), 30.0)
        way = await bench.judged(action="height", height_m=120.0)
        assert way.problem == "way"
        assert "ceiling" in way.reasons[0].text

    runner.run(scenario())


def test_where_only_the_return_is_not_clear_it_is_flown_once_that_is_accepted(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def judged_so(*arguments: Any) -> WayJudged:
        judged: WayJudged = await lane.call(*arguments)
        return replace(judged, way=replace(judged.way, problem="return"))

    async def scenario() -> None:
        stand_in: Any = SimpleNamespace(call=judged_so)
        bench = WayBench(made, stand_in)
        way = await bench.judged(action="height", height_m=20.0)
        with pytest.raises(NotCertifiedError):
            await bench.fly(FlyWayBody(id=way.id))
        assert bench.vehicle.told == []
        await bench.fly(FlyWayBody(id=way.id, accept_return=True))
        assert isinstance(bench.vehicle.told[-1], FlyWay)

    runner.run(scenario())


def test_a_way_that_was_judged_long_ago_is_asked_for_again(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        way = await bench.judged(action="height", height_m=20.0)
        late_s = time.monotonic() + CHECK_FRESH_S + 1.0
        monkeypatch.setattr("server.flying.in_flight.way_desk.time.monotonic", lambda: late_s)
        with pytest.raises(CheckNeededError, match="120 s ago"):
            await bench.fly(FlyWayBody(id=way.id))
        assert bench.vehicle.told == []
        monkeypatch.undo()

    runner.run(scenario())


def test_a_way_that_was_judged_before_home_moved_is_not_flown(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        way = await bench.judged(action="home")
        assert bench.live.state is not None
        bench.live.state = replace(bench.live.state, home_alt_amsl_m=(bench.live.state.home_alt_amsl_m or 0.0) - 0.8)
        with pytest.raises(CheckNeededError, match="Home was moved"):
            await bench.fly(FlyWayBody(id=way.id))
        assert bench.desk.state.way is None

    runner.run(scenario())


def test_a_way_that_was_judged_for_another_vehicle_is_not_this_one_s(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        bench.desk.on_link("udp/1/1")
        up = await bench.judged(action="height", height_m=20.0)
        bench.desk.on_link("udp/1/1")
        assert bench.desk.state.way == up
        bench.desk.on_link("udp/2/1")
        assert bench.desk.state.way is None
        with pytest.raises(NotFoundError):
            await bench.fly(FlyWayBody(id=up.id))

        async def judged_late(*arguments: Any) -> WayJudged:
            judged: WayJudged = await lane.call(*arguments)
            bench.desk.on_link("udp/1/1")
            return judged

        stand_in: Any = SimpleNamespace(call=judged_late)
        bench = WayBench(made, stand_in)
        with pytest.raises(ConflictError, match="Another vehicle"):
            await bench.judged(action="height", height_m=20.0)
        assert bench.desk.state == GuidedState()
        assert bench.live.way is None

    runner.run(scenario())


def test_a_paused_way_that_is_flown_again_while_the_next_is_judged_stays_on_show(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        way = await bench.judged(action="height", height_m=20.0)
        await bench.fly(FlyWayBody(id=way.id))
        bench.live.flight = FlightStatus("guided", "paused")
        asked = asyncio.create_task(bench.judged(action="height", height_m=25.0))
        while not bench.desk.state.is_judging:
            await asyncio.sleep(0)
        bench.live.flight = FlightStatus("guided", "flying")
        with pytest.raises(ConflictError, match="flown again"):
            await asked
        assert bench.desk.state == GuidedState(way=way.model_copy(update={"flies": True}))

    runner.run(scenario())


def test_a_speed_is_that_of_the_way_that_is_flown(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        way = await bench.judged(action="height", height_m=20.0)
        await bench.desk.set_speed(ME, WaySpeedBody(speed_m_s=1.5))
        assert bench.desk.state.way == way, "it is certified, and would be flown, as it was asked for"

    runner.run(scenario())


def test_what_cannot_be_judged_is_said_with_what_to_do(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        state = bench.live.state
        assert state is not None
        bench.live.state = replace(state, ground_speed_m_s=4.0)
        with pytest.raises(NotAllowedError, match=r"moves at 4\.0 m/s") as moves:
            await bench.judged(action="height")
        assert "Hold" in moves.value.advice
        bench.hovers(made.standing(), 0.0)
        with pytest.raises(NotAllowedError, match="not in the air"):
            await bench.judged(action="height")
        up = await bench.judged(action="take_off", height_m=12.0)
        assert up.problem is None
        await bench.fly(FlyWayBody(id=up.id))
        assert isinstance(bench.vehicle.told[-1], StartGuided)

        without = WayBench(made, lane)
        without.document = made.document.model_copy(update={"terrain_id": None})
        with pytest.raises(NotReadyError, match="No surface model"):
            await without.judged(action="height")
        with pytest.raises(NotAllowedError, match="no rally point"):
            await WayBench(made, lane).judged(action="rally")
        assert without.told == [], "nothing has begun"
        without.live.state = None
        with pytest.raises(NoVehicleError):
            await without.judged(action="height")

    runner.run(scenario())


def test_no_way_is_judged_from_a_home_that_lies_off_the_ground_or_may_do_so(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        state = bench.live.state
        assert state is not None
        assert state.home_alt_amsl_m is not None
        bench.live.state = replace(state, home_alt_amsl_m=state.home_alt_amsl_m - 8.0)
        with pytest.raises(NotAllowedError, match=r"moved in flight to a height that is 8\.0 m below the ground"):
            await bench.judged(action="height", height_m=20.0)
        bench.live.state = replace(state, gnss_fix="3d")
        bench.live.track.states = [state]
        with pytest.raises(NotAllowedError, match="Home of the take-off was not heard here"):
            await bench.judged(action="height", height_m=20.0)
        assert bench.desk.state == GuidedState()

    runner.run(scenario())


@pytest.mark.parametrize("action", ["to", "look", "orbit"])
def test_a_place_belongs_to_what_leads_to_one(action: str) -> None:
    with pytest.raises(ParameterError, match="needs a place"):
        wish_of(WayBody.model_validate({"action": action}), ())


def test_a_place_is_refused_where_it_means_nothing() -> None:
    with pytest.raises(ParameterError, match="takes no place"):
        wish_of(WayBody(action="home", place=PlaceDoc(lat_deg=1.0, lon_deg=1.0)), ())


def test_the_way_back_begins_at_the_top_of_the_take_off() -> None:
    def at(up_m: float, north_m: float, landed: Any = "in_air") -> VehicleState:
        lat_deg = math.degrees(north_m / 6_371_000.0)
        return VehicleState(1, 1, lat_deg=lat_deg, lon_deg=0.0, alt_rel_home_m=up_m, landed=landed)

    climb = [at(0.0, 0.0, "on_ground"), *(at(up, 0.1) for up in (1.0, 4.0, 8.0))]
    places = flown_places([*climb, at(8.0, 5.0), at(9.0, 10.0)])
    assert [place[2] for place in places] == [8.0, 8.0, 9.0]
    assert [place[2] for place in flown_places(climb)] == [8.0]
    assert flown_places([]) == ()


def test_a_way_to_another_vehicle_is_refused_and_so_is_one_that_another_came_into(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        place = bench.beside(30.0, 0.0)
        up = await bench.judged(action="to", place=place, height_m=20.0)
        alt_m = bench.live.way.places[-1][2] if bench.live.way else math.nan
        hovers = replace(
            bench.live.state or VehicleState(1, 1),
            lat_deg=place.lat_deg,
            lon_deg=place.lon_deg,
            alt_rel_home_m=alt_m,
            alt_amsl_m=(bench.live.state.home_alt_amsl_m or 0.0) + alt_m if bench.live.state else None,
        )
        bench.others = [Flown("Bee", hovers, None)]
        with pytest.raises(CheckNeededError, match="may come within 0 m of Bee in"):
            await bench.fly(FlyWayBody(id=up.id))
        assert bench.live.led is None
        way = await bench.judged(action="to", place=place, height_m=20.0)
        assert (way.problem, way.reasons[0].code) == ("others", "others")
        assert "lead Bee away" in way.reasons[0].mend
        with pytest.raises(NotCertifiedError, match="Another vehicle is in the way: It may come within 0 m of Bee"):
            await bench.fly(FlyWayBody(id=way.id, accept_return=True))
        assert not any(isinstance(request, FlyWay) for request in bench.vehicle.told)
        bench.others = []
        way = await bench.judged(action="to", place=place, height_m=20.0)
        bravo = Flown("Bravo's Bee", replace(hovers, alt_amsl_m=None), None, key="Bravo/1")
        bench.others = [bravo]
        with pytest.raises(CheckNeededError, match="Since the way was judged Bravo's Bee came to where it leads"):
            await bench.fly(FlyWayBody(id=way.id))
        way = await bench.judged(action="to", place=place, height_m=20.0)
        assert any("call the other station" in note for note in way.notes)
        vehicle: Any = bench.vehicle
        call = vehicle.call

        async def call_while_others_are_judged(request: Any) -> Any:
            assert bench.live.led_ahead() is not None, "whoever is ordered at this moment sees it"
            return await call(request)

        vehicle.call = call_while_others_are_judged
        await bench.fly(FlyWayBody(id=way.id))
        bench.live.flight = FlightStatus("guided", "flying", since_utc_s=time.time())
        bench.desk.on_flight(bench.live.flight)
        ahead = bench.live.led_ahead()
        assert ahead is not None
        left_s = float(ahead.t_s[-1])
        await bench.desk.set_speed(ME, WaySpeedBody(speed_m_s=way.speed_m_s / 2))
        slower = bench.live.led_ahead()
        assert slower is not None
        assert float(slower.t_s[-1]) > 1.5 * left_s
        # What is held may be gone on with, whatever was judged since.
        bench.live.flight = FlightStatus("guided", "paused", since_utc_s=time.time())
        bench.desk.on_flight(bench.live.flight)
        vehicle.call = call
        await bench.judged(action="home", height_m=40.0)
        assert bench.live.led_ahead() is None
        bench.live.flight = FlightStatus("guided", "flying", since_utc_s=time.time())
        assert bench.live.led_ahead() is not None
        bench.desk.on_flight(FlightStatus("guided", "landed", since_utc_s=time.time()))
        assert bench.live.led is None

    runner.run(scenario())
