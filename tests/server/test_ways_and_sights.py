"""What sensors have seen, and ways: it is in what is judged, and where more is seen near one it is not flown."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.frames import moved_deg, offset_m
from server.errors import CheckNeededError, NotReadyError
from server.flying.apart.nearness import Flown
from server.flying.in_flight import way_desk
from server.obstacles.surroundings import SEEN_BEFORE, _is_near, is_more_seen_near, returns_from
from server.scene.mirror import MapMirror
from server.schemas import FlyWayBody
from server.work.jobs import Lane
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.requests import FlyWay
from tests.server.flying_desk_bench import Made
from tests.server.in_flight_benches import WayBench
from tests.server.obstacle_messages import delta

pytestmark = pytest.mark.xdist_group("flying-desk")


def test_what_a_sensor_has_seen_is_in_the_model_that_is_judged(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
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


def test_a_way_near_which_more_is_seen_since_it_was_judged_is_not_flown(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
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
        assert bench.live.way is not None
        top = int(bench.live.way.places[-1][2])
        wall = [(15, 0, z) for z in range(top + 2)]
        radar.fold(delta(wall, since=3, revision=4, **told))
        with pytest.raises(CheckNeededError, match="seen more near the way since it was judged: now it is") as refused:
            await bench.fly(FlyWayBody(id=way.id))
        assert refused.value.advice == "Look at it again before it is flown."
        assert bench.desk.state.way is not None
        assert bench.desk.state.way.id != way.id, "what it is now is in hand, and was looked at by nobody"
        radar.fold(delta(wall, 20, since=4, revision=5, **told))
        way = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        monkeypatch.setattr(way_desk, "SEEN_WITHIN_S", 0.0)
        radar.fold(delta(old, whole=True, revision=6, parts=2, **told))
        with pytest.raises(NotReadyError, match="Parts of the radar map"):
            await bench.fly(FlyWayBody(id=way.id))
        assert bench.vehicle.told == []
        radar.fold(delta([], whole=True, revision=6, part=1, parts=2, **told))
        # A wrong match changes nothing of the way: it is judged anew, and flown.
        radar.fold(delta([(15, 20, 20)], since=6, revision=7, **told))
        judged = sum(state.is_judging for state in bench.told)
        await bench.fly(FlyWayBody(id=way.id))
        assert isinstance(bench.vehicle.told[-1], FlyWay)
        assert sum(state.is_judging for state in bench.told) > judged
        assert bench.desk.state.way is not None
        assert (bench.desk.state.way.id, bench.desk.state.way.flies) == (way.id, True)

    runner.run(scenario())


def test_a_way_is_not_flown_where_more_is_seen_near_a_return_to_a_rally_point_from_it(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        assert bench.live.state is not None
        told = {"origin": MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0), "resolution_m": 1.0}
        radar = bench.watch.mirrors["radar"]
        radar.fold(delta([], whole=True, revision=1, **told))
        ways = [await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)]
        radar.fold(delta([(0, 64, 1)], since=1, revision=2, **told))
        in_hand = bench.desk._in_hand
        assert in_hand is not None
        assert not await bench.desk._sees_more(in_hand)
        radar.fold(delta([(0, 64, 1)], 20, since=2, revision=3, **told))
        bench.vehicle.places["rally"] = made.rally(north_m=80.0)
        ways.append(await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0))
        assert [way.problem for way in ways] == [None, None], ways[-1].reasons
        radar.fold(delta([(0, 64, z) for z in range(60)], since=3, revision=4, **told))
        with pytest.raises(CheckNeededError, match="seen more near the way"):
            await bench.fly(FlyWayBody(id=ways[-1].id))
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
        bench = WayBench(made, lane, up_m=0.0)
        assert bench.live.state is not None
        origin, radar = MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0), bench.watch.mirrors["radar"]
        way = await bench.judged(action="take_off", height_m=10.0)
        assert way.problem is None, way.reasons
        radar.fold(delta([(1, 1, z) for z in range(12)], whole=True, origin=origin))
        with pytest.raises(CheckNeededError, match="seen more near the way"):
            await bench.fly(FlyWayBody(id=way.id))
        radar.fold(delta([], whole=True, revision=2, origin=origin))
        way = await bench.judged(action="take_off", height_m=10.0)
        radar.fold(delta([(12, 8, 0), (12, 8, 1)], whole=True, revision=3, origin=origin))
        await bench.fly(FlyWayBody(id=way.id))
        assert bench.vehicle.told

    runner.run(scenario())


def test_of_another_one_that_came_meanwhile_is_said_though_more_is_seen(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    """What is judged once more is no more than what was shown: whom nobody read of it is not flown to."""

    async def scenario() -> None:
        bench = WayBench(made, lane)
        assert bench.live.state is not None
        told: dict[str, Any] = {"origin": MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0)}
        radar, place = bench.watch.mirrors["radar"], bench.beside(30.0, 0.0)
        radar.fold(delta([], whole=True, revision=1, **told))
        way = await bench.judged(action="to", place=place, height_m=20.0)
        there = replace(bench.live.state, lat_deg=place.lat_deg, lon_deg=place.lon_deg, alt_amsl_m=None)
        bench.others = [Flown("Bravo's Bee", there, None, key="Bravo/1")]
        radar.fold(delta([(15, 20, 20)], since=1, revision=2, **told))
        with pytest.raises(CheckNeededError, match="now it is as it is shown"):
            await bench.fly(FlyWayBody(id=way.id))
        assert bench.vehicle.told == []
        shown = bench.desk.state.way
        assert shown is not None
        assert any("Bravo's Bee" in note for note in shown.notes)
        await bench.fly(FlyWayBody(id=shown.id))
        assert isinstance(bench.vehicle.told[-1], FlyWay)

    runner.run(scenario())


def test_what_is_seen_while_it_is_judged_once_more_counts(made: Made, lane: Lane, runner: asyncio.Runner) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        assert bench.live.state is not None
        told: dict[str, Any] = {"origin": MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0)}
        radar, call = bench.watch.mirrors["radar"], lane.call
        radar.fold(delta([], whole=True, revision=1, **told))
        way = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        radar.fold(delta([(15, 20, 20)], since=1, revision=2, **told))
        looks: list[int] = []

        async def call_while_a_wall_comes(*args: Any) -> Any:
            judged = await call(*args)
            looks.append(1)
            if len(looks) == 1:
                assert bench.live.way is not None
                top = int(bench.live.way.places[-1][2])
                radar.fold(delta([(15, 0, z) for z in range(top + 2)], since=2, revision=3, **told))
            return judged

        bench.desk._lane = cast(Any, SimpleNamespace(call=call_while_a_wall_comes))
        with pytest.raises(CheckNeededError, match="now it is as it is shown"):
            await bench.fly(FlyWayBody(id=way.id))
        assert len(looks) == 2
        assert bench.vehicle.told == []

    runner.run(scenario())


def test_a_plan_that_changed_meanwhile_changes_nothing_of_what_was_shown(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = WayBench(made, lane)
        assert bench.live.state is not None
        told: dict[str, Any] = {"origin": MapOrigin(*made.home, bench.live.state.home_alt_amsl_m or 0.0)}
        radar = bench.watch.mirrors["radar"]
        radar.fold(delta([], whole=True, revision=1, **told))
        way = await bench.judged(action="to", place=bench.beside(30.0, 0.0), height_m=20.0)
        radar.fold(delta([(15, 20, 20)], since=1, revision=2, **told))
        profile = bench.document.profile.model_copy(update={"mean_speed_m_s": 5.0})
        bench.document = bench.document.model_copy(update={"profile": profile})
        await bench.fly(FlyWayBody(id=way.id))
        request = bench.vehicle.told[-1]
        assert isinstance(request, FlyWay)
        assert {target.speed_m_s for target in request.targets} == {way.speed_m_s}, "by what was shown"

    runner.run(scenario())
