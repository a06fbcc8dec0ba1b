"""Home at the desk: judged over the open model, set as it was judged, and Return judged anew once home has moved."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from typing import Any

import pytest

from server.errors import CheckNeededError, ConflictError, NotFoundError, NotReadyError
from server.flying.in_flight import way_desk
from server.obstacles.surroundings import SEEN_BEFORE
from server.schemas import HomeBody, HomeState, SetHomeBody
from server.schemas.flight_docs import CHECK_FRESH_S
from server.work.jobs import Lane
from telemetry.errors import NotAllowedError
from telemetry.flight.home_watch import home_of
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.requests import SetHome
from tests.server.flying_desk_bench import ME, Made
from tests.server.in_flight_benches import FAR, HomeBench, shows
from tests.server.obstacle_messages import delta

pytestmark = pytest.mark.xdist_group("flying-desk")


def test_home_there_lies_on_the_models_ground_and_is_set_as_it_was_judged(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane)
        doc, there = await bench.asked(20.0), made.standing(east_m=20.0)
        home = home_of(bench.state)
        assert home is not None
        assert there.alt_amsl_m is not None
        assert doc.moves_m == pytest.approx(20.0, abs=0.1)
        assert doc.rises_m == pytest.approx(there.alt_amsl_m - home.alt_amsl_m, abs=0.05)
        assert doc.ret is not None
        assert doc.ret.state in ("certified", "not_certified")
        assert [state.is_judging for state in bench.told] == [True, False]
        with pytest.raises(NotFoundError, match="Another home"):
            await bench.desk.set(ME, SetHomeBody(id="another"))
        assert bench.vehicle.told == []
        await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert bench.vehicle.told == [SetHome(ME, doc.lat_deg, doc.lon_deg, doc.alt_amsl_m)]
        assert bench.desk.state.asked is None

    runner.run(scenario())


def test_what_was_judged_long_ago_is_not_set(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane, up_m=0.0)
        doc = await bench.asked()
        assert (doc.is_here, doc.ret) == (True, None)
        assert "stays there when the vehicle arms" in doc.changes[0]
        later_s = time.monotonic() + CHECK_FRESH_S + 1.0
        monkeypatch.setattr(time, "monotonic", lambda: later_s)
        with pytest.raises(CheckNeededError):
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert bench.vehicle.told == []

    runner.run(scenario())


def test_home_is_not_where_the_model_knows_no_ground_nor_on_a_height_that_nobody_knows(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane)
        with pytest.raises(NotAllowedError, match="Home cannot be there: the surface model ends"):
            await bench.desk.judge(ME, HomeBody.model_validate({"place": {"lat_deg": 37.0, "lon_deg": 14.0}}))
        assert not bench.desk.state.is_judging
        right = await bench.asked(20.0)
        bench.moves(0.0, up_m=-8.0)
        again = await bench.asked(20.0)
        assert again.alt_amsl_m == pytest.approx(right.alt_amsl_m), "it lies on the ground again"
        assert again.rises_m == pytest.approx(right.rises_m + 8.0)
        bench.live.track.states = [bench.state]
        bench.live.state = replace(bench.state, gnss_fix="3d")
        with pytest.raises(NotAllowedError, match="Home of the take-off was not heard"):
            await bench.asked(20.0)
        stands = HomeBench(made, lane, up_m=0.0)
        stands.live.state = replace(stands.state, gnss_alt_amsl_m=(stands.state.alt_amsl_m or 0.0) - 6.0,
                                    vertical_accuracy_m=0.02)  # fmt: skip
        with pytest.raises(NotAllowedError, match="By its receiver"):
            await stands.asked()
        with pytest.raises(NotAllowedError, match="only be set where the vehicle stands"):
            await stands.asked(20.0)

    runner.run(scenario())


def test_a_home_that_moved_has_its_return_judged_without_anybody_asking(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane)
        judging = asyncio.ensure_future(bench.desk.run())
        try:
            bench.desk.on_state(bench.state)
            bench.moves(0.4)
            assert bench.desk.state == HomeState(), "it wanders"
            bench.moves(20.0)
            await shows(lambda: bench.desk.state.ret)
            first = bench.desk.state.ret
            assert first is not None
            assert any(state.is_judging_return for state in bench.told)
            bench.moves(-400.0)
            moved = bench.desk.state.ret
            assert moved is not None
            assert [reason.text for reason in moved.reasons] == ["Home has moved again."]
            await shows(lambda: bench.desk.state.ret not in (None, first, moved))
            newest = bench.desk.state.ret
            assert newest is not None
            assert newest.state != "certified"
            assert newest.reasons
            bench.live.state = replace(bench.state, armed=False, landed="on_ground")
            bench.desk.on_state(bench.state)
            assert bench.desk.state.ret is None
        finally:
            judging.cancel()

    runner.run(scenario())


def test_a_home_that_was_judged_is_not_set_once_home_or_vehicle_is_another(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane)
        bench.desk.on_link("one")
        doc = await bench.asked(20.0)
        bench.moves(5.0)
        with pytest.raises(CheckNeededError, match="Home was moved"):
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        here = await bench.asked()
        there = made.standing(east_m=4.0)
        bench.live.state = replace(bench.state, lat_deg=there.lat_deg, lon_deg=there.lon_deg)
        with pytest.raises(CheckNeededError, match="The vehicle has moved"):
            await bench.desk.set(ME, SetHomeBody(id=here.id))
        another = asyncio.ensure_future(bench.asked(20.0))
        async with asyncio.timeout(60.0):
            while not bench.desk.state.is_judging:  # not for long: no pause in which it is over
                await asyncio.sleep(0)
        bench.desk.on_link("other")
        with pytest.raises(ConflictError, match="Another vehicle"):
            await another
        assert (bench.desk.state.asked, bench.vehicle.told, bench.sets) == (None, [], 0)

    runner.run(scenario())


def test_a_home_near_whose_return_more_is_seen_since_it_was_judged_is_not_set(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane)
        radar, home = bench.watch.mirrors["radar"], home_of(bench.state)
        assert home is not None
        origin = MapOrigin(home.lat_deg, home.lon_deg, home.alt_amsl_m)
        told: dict[str, Any] = {"origin": origin, "resolution_m": 1.0, "began_mono_s": 1.0}
        aside = [(10, 12, 1), (10, 12, 2)]
        radar.fold(delta(aside, whole=True, **told))
        before = delta([(10, -9, 2)], sensor="vision_flight", whole=True, **told)
        bench.watch.mirrors["vision_flight"].fold(before)
        doc = await bench.asked(20.0)
        assert doc.ret is not None
        assert doc.ret.state == "certified", doc.ret.reasons
        assert doc.ret.notes == [SEEN_BEFORE], "it does not count, and is said"
        mast = [(10, 0, up) for up in range(3)]
        radar.fold(delta(mast, since=1, revision=2, **told))
        with pytest.raises(CheckNeededError, match="seen more near the return to that home") as refused:
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert refused.value.advice == "Ask for home again."
        bench.live.state = replace(bench.state, ground_speed_m_s=5.0)
        with pytest.raises(CheckNeededError, match="seen more near") as refused:
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert refused.value.advice == "Hold, then ask for home again."
        monkeypatch.setattr(way_desk, "SEEN_WITHIN_S", 0.0)
        radar.fold(delta(aside, whole=True, revision=3, parts=2, **told))
        with pytest.raises(NotReadyError, match="Parts of the radar map"):
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert (bench.vehicle.told, bench.sets) == ([], 0)
        # The mast is gone; what is seen is what was seen, a metre beside it, and something far away.
        beside = [(11, 12, 1), (-300, 0, 9)]
        radar.fold(delta(beside, whole=True, revision=3, part=1, parts=2, **told))
        await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert bench.vehicle.told == [SetHome(ME, doc.lat_deg, doc.lon_deg, doc.alt_amsl_m)]

    runner.run(scenario())


def test_a_home_is_not_set_where_more_is_seen_near_the_way_to_a_rally_point(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    """Autopilots return to the nearest of rally points and home."""

    async def scenario() -> None:
        bench = HomeBench(made, lane)
        bench.vehicle.places["rally"] = made.rally(**FAR)
        radar, home = bench.watch.mirrors["radar"], home_of(bench.state)
        assert home is not None
        told: dict[str, Any] = {"origin": MapOrigin(home.lat_deg, home.lon_deg, home.alt_amsl_m), "resolution_m": 1.0}
        radar.fold(delta([], whole=True, revision=1, **told))
        doc = await bench.asked(20.0)
        assert doc.ret is not None
        assert doc.ret.state == "certified", doc.ret.reasons
        east, north = round(0.8 * FAR["east_m"]), round(0.8 * FAR["north_m"])
        radar.fold(delta([(-east, -north, 1)], since=1, revision=2, **told))
        asked = bench.desk._asked
        assert asked is not None
        await asked.check_seen(bench.state, bench.desk._ways)
        radar.fold(delta([(east, north, 1)], since=2, revision=3, **told))
        with pytest.raises(CheckNeededError, match="seen more near the return to that home"):
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        # A guided way in the return's place promises no way to a rally point; it leads where it leads.
        ret = doc.ret.model_copy(update={"state": "not_certified", "instead": True})
        along = (made.home, (doc.lat_deg, doc.lon_deg))
        instead = replace(asked, doc=doc.model_copy(update={"ret": ret}), led=replace(asked.led, instead_deg=along))
        await instead.check_seen(bench.state, bench.desk._ways)
        there = made.standing(**FAR)
        around = (made.home, (there.lat_deg or 0.0, there.lon_deg or 0.0), along[1])
        with pytest.raises(CheckNeededError, match="seen more near the return to that home"):
            await replace(instead, led=replace(asked.led, instead_deg=around)).check_seen(bench.state, bench.desk._ways)
        await bench.asked(20.0)
        assert bench.vehicle.told == []

    runner.run(scenario())


def test_a_home_whose_return_was_not_certified_anyway_is_set_whatever_is_seen(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane)
        bench.vehicle.parameters = {}
        doc = await bench.asked(20.0)
        assert doc.ret is not None
        assert doc.ret.state == "not_certified"
        asked = bench.desk._asked
        assert asked is not None
        assert [len(asked.led.instead_deg) > 1, asked.led.required_m > 0.0] == [doc.ret.instead, True]
        if doc.ret.instead:
            ret = doc.ret.model_copy(update={"instead": False})
            bench.desk._asked = replace(asked, doc=doc.model_copy(update={"ret": ret}))
        bench.watch.mirrors["radar"].expect(10.0)
        await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert bench.vehicle.told

    runner.run(scenario())


@pytest.mark.parametrize("up_m", [0.0, 30.0])
def test_a_home_that_was_judged_on_the_ground_is_not_set_in_the_air_nor_the_other_way_round(
    made: Made, lane: Lane, runner: asyncio.Runner, up_m: float
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane, up_m=up_m)
        doc = await bench.asked(20.0 if up_m else None)
        bench.live.state = replace(bench.state, armed=True, landed="on_ground" if up_m else "in_air")
        with pytest.raises(CheckNeededError, match="has landed since" if up_m else "has taken off since"):
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert bench.vehicle.told == []

    runner.run(scenario())
