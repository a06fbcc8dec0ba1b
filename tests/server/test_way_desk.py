"""Guided ways at the desk: judged over the open model with what is on board, flown only where that was certified."""

from __future__ import annotations

import asyncio
import math
import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.frames import moved_deg, offset_m
from planning.errors import ParameterError
from planning.fence.fence_model import Fence, circle
from planning.formats.fence_items import fence_items
from server.errors import CheckNeededError, ConflictError, NotCertifiedError, NotFoundError, NotReadyError
from server.flying.in_flight import way_desk
from server.flying.in_flight.way_desk import WayDesk, flown_places
from server.flying.in_flight.way_task import WayJudged, wish_of
from server.heard.channel import Channel, ShownWay
from server.obstacles.obstacle_watch import Watch
from server.obstacles.surroundings import SEEN_BEFORE, _is_near, is_more_seen_near, returns_from
from server.scene.mirror import MapMirror
from server.schemas import FenceDoc, FlyWayBody, GuidedState, PlaceDoc, WayBody, WayDoc, WaySpeedBody
from server.schemas.flight_docs import CHECK_FRESH_S
from server.work.jobs import Lane
from telemetry.errors import NotAllowedError, NoVehicleError
from telemetry.mavlink.items import wire_items
from telemetry.topics.messages import FlightStatus
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.requests import FlyWay, SetSpeed, StartGuided
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told
from tests.server.flying_desk_bench import ME, Made, Vehicle
from tests.server.obstacle_messages import delta

pytestmark = pytest.mark.xdist_group("flying-desk")


LONG_S = 600.0
"""Positions are of now for so long: a busy machine judges slowly."""


class Bench:
    """A desk over the demo's model, and a vehicle that hovers over the plan's home."""

    def __init__(self, made: Made, lane: Lane, *, up_m: float = 30.0) -> None:
        self.made, self.vehicle, self.document = made, Vehicle(), made.document
        self.told: list[GuidedState] = []
        me: Any = self
        self.live = Channel("live", Told())
        self.hovers(made.standing(), up_m)
        self.watch = Watch("live", Told())
        self.desk = WayDesk(me.vehicle, self.live, me, made.library, lane, self.watch, me)

    def publish(self, message: Any) -> None:
        self.told.append(message.guided)

    def hovers(self, standing: VehicleState, up_m: float) -> None:
        now_s = time.monotonic() + LONG_S
        flies = {"armed": True, "landed": "in_air", "alt_rel_home_m": up_m} if up_m else {}
        self.live.state = replace(standing, position_t_mono_s=now_s, gnss_t_mono_s=now_s, **flies)
        self.live.track.states = [standing, self.live.state]

    def beside(self, east_m: float, north_m: float) -> PlaceDoc:
        there = self.made.standing(east_m=east_m, north_m=north_m)
        assert there.lat_deg is not None
        assert there.lon_deg is not None
        return PlaceDoc(lat_deg=there.lat_deg, lon_deg=there.lon_deg)

    async def judged(self, **body: Any) -> WayDoc:
        way = (await self.desk.judge(ME, WayBody.model_validate(body))).way
        assert way is not None
        return way


def test_a_way_is_judged_shown_and_flown_from_where_the_vehicle_hovers(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
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
            await bench.desk.fly(ME, FlyWayBody(id="another"))
        await bench.desk.fly(ME, FlyWayBody(id=way.id))
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
        bench = Bench(made, lane)
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
                await bench.desk.fly(ME, FlyWayBody(id=way.id, accept_return=accepts))

    runner.run(scenario())


def test_the_plans_own_ceiling_holds_although_no_vehicle_keeps_it(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
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
        bench = Bench(made, stand_in)
        way = await bench.judged(action="height", height_m=20.0)
        with pytest.raises(NotCertifiedError):
            await bench.desk.fly(ME, FlyWayBody(id=way.id))
        assert bench.vehicle.told == []
        await bench.desk.fly(ME, FlyWayBody(id=way.id, accept_return=True))
        assert isinstance(bench.vehicle.told[-1], FlyWay)

    runner.run(scenario())


def test_what_a_sensor_has_seen_is_in_the_model_that_is_judged(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        free = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        state = bench.live.state
        assert state is not None
        assert state.home_alt_amsl_m is not None
        origin = MapOrigin(*made.home, state.home_alt_amsl_m)
        wall = [(15, north, 34) for north in range(-20, 20)]
        radar = bench.watch.mirrors["radar"]
        radar.on_flight(flies=True)
        radar.fold(delta(wall, whole=True, origin=origin, began_mono_s=1.0))
        bench.hovers(made.standing(), 30.0)
        way = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        assert way.has_seen
        radar.fold(delta([], whole=True, origin=origin, began_mono_s=2.0))
        bench.hovers(made.standing(), 30.0)
        again = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        assert (again.problem, again.length_m) == (way.problem, way.length_m), "the radar's node was started again"
        assert way.problem != free.problem or way.length_m > free.length_m + 5.0, "over the wall, or not at all"
        assert free.problem is None

    runner.run(scenario())


def test_a_way_that_was_judged_long_ago_is_asked_for_again(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        way = await bench.judged(action="height", height_m=20.0)
        late_s = time.monotonic() + CHECK_FRESH_S + 1.0
        monkeypatch.setattr("server.flying.in_flight.way_desk.time.monotonic", lambda: late_s)
        with pytest.raises(CheckNeededError, match="120 s ago"):
            await bench.desk.fly(ME, FlyWayBody(id=way.id))
        assert bench.vehicle.told == []
        monkeypatch.undo()

    runner.run(scenario())


def test_a_way_near_which_more_is_seen_since_it_was_judged_is_not_flown(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        assert bench.live.state is not None
        origin = MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0)
        radar = bench.watch.mirrors["radar"]
        told = {"origin": origin, "began_mono_s": 1.0}
        old = [(-200, 0, 3), (0, -29, 1)]
        radar.fold(delta(old, whole=True, revision=1, **told))
        before = delta([(12, 5, 9)], sensor="vision_flight", whole=True, **told)
        bench.watch.mirrors["vision_flight"].fold(before)
        way = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        assert way.problem is None
        assert SEEN_BEFORE in way.notes, "it does not count, and is said"
        # Near it only known ground and what it was judged by; something else far away.
        radar.fold(delta([(15, 0, 0)], explained=1, since=1, revision=2, **told))
        radar.fold(delta([(0, -29, 1), (15, 90, 34), (300, 0, 9)], 250, since=2, revision=3, **told))
        seen = radar.seen()
        assert seen is not None
        line = [made.home, made.home]
        assert not is_more_seen_near(seen, seen, line, 1000.0)
        assert is_more_seen_near((), seen, line, 1000.0)
        radar.fold(delta([(16, 1, 34)], since=3, revision=4, **told))
        with pytest.raises(CheckNeededError, match="seen more near the way") as refused:
            await bench.desk.fly(ME, FlyWayBody(id=way.id))
        assert refused.value.advice == "Ask for the way again."
        radar.fold(delta([(16, 1, 34)], 20, since=4, revision=5, **told))
        monkeypatch.setattr(way_desk, "SEEN_WITHIN_S", 0.0)
        radar.fold(delta(old, whole=True, revision=6, parts=2, **told))
        with pytest.raises(NotReadyError, match="Parts of the radar map"):
            await bench.desk.fly(ME, FlyWayBody(id=way.id))
        assert bench.vehicle.told == []
        radar.fold(delta([], whole=True, revision=6, part=1, parts=2, **told))
        await bench.desk.fly(ME, FlyWayBody(id=way.id))
        assert isinstance(bench.vehicle.told[-1], FlyWay)

    runner.run(scenario())


def test_a_way_is_not_flown_where_more_is_seen_near_a_return_to_a_rally_point_from_it(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        assert bench.live.state is not None
        told = {"origin": MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0), "resolution_m": 1.0}
        radar = bench.watch.mirrors["radar"]
        radar.fold(delta([], whole=True, revision=1, **told))
        ways = [await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)]
        radar.fold(delta([(0, 64, 1)], since=1, revision=2, **told))
        in_hand = bench.desk._in_hand
        assert in_hand is not None
        await bench.desk._check_seen(in_hand)
        radar.fold(delta([(0, 64, 1)], 20, since=2, revision=3, **told))
        bench.vehicle.places["rally"] = made.rally(north_m=80.0)
        ways.append(await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0))
        assert [way.problem for way in ways] == [None, None], ways[-1].reasons
        radar.fold(delta([(0, 64, 1)], since=3, revision=4, **told))
        with pytest.raises(CheckNeededError, match="seen more near the way"):
            await bench.desk.fly(ME, FlyWayBody(id=ways[-1].id))
        assert bench.vehicle.told == []

    runner.run(scenario())


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-300.0, 300.0)] * 2), min_size=2, max_size=4),
    st.lists(st.tuples(*[st.floats(-300.0, 300.0)] * 2), min_size=1, max_size=3),
    st.tuples(*[st.floats(0.0, 1.0)] * 2),
    st.integers(0, 11),
)
def test_whatever_a_return_from_anywhere_on_a_way_passes_over_lies_near_the_line(
    places: list[tuple[float, float]], ends: list[tuple[float, float]], share: tuple[float, float], chosen: int
) -> None:
    def deg(place: tuple[float, float]) -> tuple[float, float]:
        return moved_deg((46.0, 7.0), *place)

    line_deg = returns_from([deg(place) for place in places], [deg(end) for end in ends], 10.0)
    line = np.array([offset_m((46.0, 7.0), *place) for place in line_deg])
    a, b = np.array(places[chosen % (len(places) - 1) :][:2])
    start = a + share[0] * (b - a)
    over = start + share[1] * (np.array(ends[chosen % len(ends)]) - start)
    assert _is_near(over[None], line, 10.2).all()


def test_what_is_seen_again_a_little_elsewhere_is_the_same_thing() -> None:
    """A camera's map is made anew at every frame, by a vehicle that wanders; a map begun anew has another origin."""
    rng, home = np.random.default_rng(5), MapOrigin(46.0, 7.0, 500.0)
    lat_deg, lon_deg = moved_deg((46.0, 7.0), 40.0, 3.0)
    elsewhere, shift_m = MapOrigin(lat_deg, lon_deg, 502.0), np.array([40.0, 3.0, 2.0])
    line = [(46.0, 7.0), moved_deg((46.0, 7.0), 0.0, 60.0)]
    east, up = np.meshgrid(np.arange(-5.0, 5.0, 0.2), np.arange(0.0, 8.0, 0.2))
    wall = np.column_stack([east.ravel(), np.full(east.size, 6.0), up.ravel()])

    def frame(*more: tuple[float, float, float], origin: MapOrigin = home) -> tuple[Any, ...]:
        mirror = MapMirror("vision")
        seen = np.concatenate([wall, np.reshape(more, (-1, 3))]) + rng.uniform(-0.15, 0.15, 3)
        seen += rng.normal(0.0, 0.05, seen.shape) - (shift_m if origin is elsewhere else 0.0)
        keys = {(int(x), int(y), int(z)) for x, y, z in np.floor(seen / 0.5)}
        mirror.fold(delta(sorted(keys), whole=True, origin=origin, resolution_m=0.5))
        found = mirror.seen()
        assert found is not None
        return found

    judged_by = frame()
    assert not any(is_more_seen_near(judged_by, frame(), line, 28.0) for _ in range(30))
    assert not is_more_seen_near(judged_by, frame(origin=elsewhere), line, 28.0)
    assert is_more_seen_near(judged_by, frame((0.0, 3.0, 4.0)), line, 28.0), "it stands before the wall"
    assert is_more_seen_near(judged_by, frame((0.0, 3.0, 4.0), origin=elsewhere), line, 28.0)
    assert not is_more_seen_near(judged_by, frame((0.0, 100.0, 4.0)), line, 28.0), "far from the way"


def test_who_walks_about_beside_a_take_off_is_no_matter_unless_he_is_near_it(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane, up_m=0.0)
        assert bench.live.state is not None
        origin, radar = MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0), bench.watch.mirrors["radar"]
        way = await bench.judged(action="take_off", height_m=10.0)
        assert way.problem is None, way.reasons
        radar.fold(delta([(1, 1, 0)], whole=True, origin=origin))
        with pytest.raises(CheckNeededError, match="seen more near the way"):
            await bench.desk.fly(ME, FlyWayBody(id=way.id))
        radar.fold(delta([(12, 8, 0), (12, 8, 1)], whole=True, revision=2, origin=origin))
        await bench.desk.fly(ME, FlyWayBody(id=way.id))
        assert bench.vehicle.told

    runner.run(scenario())


def test_a_way_that_was_judged_before_home_moved_is_not_flown(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        way = await bench.judged(action="home")
        assert bench.live.state is not None
        bench.live.state = replace(bench.live.state, home_alt_amsl_m=(bench.live.state.home_alt_amsl_m or 0.0) - 0.8)
        with pytest.raises(CheckNeededError, match="Home was moved"):
            await bench.desk.fly(ME, FlyWayBody(id=way.id))
        assert bench.desk.state.way is None

    runner.run(scenario())


def test_a_way_that_was_judged_for_another_vehicle_is_not_this_one_s(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        bench.desk.on_link("udp/1/1")
        up = await bench.judged(action="height", height_m=20.0)
        bench.desk.on_link("udp/1/1")
        assert bench.desk.state.way == up
        bench.desk.on_link("udp/2/1")
        assert bench.desk.state.way is None
        with pytest.raises(NotFoundError):
            await bench.desk.fly(ME, FlyWayBody(id=up.id))

        async def judged_late(*arguments: Any) -> WayJudged:
            judged: WayJudged = await lane.call(*arguments)
            bench.desk.on_link("udp/1/1")
            return judged

        stand_in: Any = SimpleNamespace(call=judged_late)
        bench = Bench(made, stand_in)
        with pytest.raises(ConflictError, match="Another vehicle"):
            await bench.judged(action="height", height_m=20.0)
        assert bench.desk.state == GuidedState()
        assert bench.live.way is None

    runner.run(scenario())


def test_a_paused_way_that_is_flown_again_while_the_next_is_judged_stays_on_show(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        way = await bench.judged(action="height", height_m=20.0)
        await bench.desk.fly(ME, FlyWayBody(id=way.id))
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
        bench = Bench(made, lane)
        way = await bench.judged(action="height", height_m=20.0)
        await bench.desk.set_speed(ME, WaySpeedBody(speed_m_s=1.5))
        assert bench.desk.state.way == way, "it is certified, and would be flown, as it was asked for"

    runner.run(scenario())


def test_what_cannot_be_judged_is_said_with_what_to_do(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
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
        await bench.desk.fly(ME, FlyWayBody(id=up.id))
        assert isinstance(bench.vehicle.told[-1], StartGuided)

        without = Bench(made, lane)
        without.document = made.document.model_copy(update={"terrain_id": None})
        with pytest.raises(NotReadyError, match="No surface model"):
            await without.judged(action="height")
        with pytest.raises(NotAllowedError, match="no rally point"):
            await Bench(made, lane).judged(action="rally")
        assert without.told == [], "nothing has begun"
        without.live.state = None
        with pytest.raises(NoVehicleError):
            await without.judged(action="height")

    runner.run(scenario())


def test_no_way_is_judged_from_a_home_that_lies_off_the_ground_or_may_do_so(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
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
