"""Home at the desk: judged over the open model, set as it was judged, and Return judged anew once home has moved."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mapping.geometry.frames import moved_deg
from server.errors import CheckNeededError, ConflictError, NotFoundError, NotReadyError
from server.flying.in_flight import home_desk, way_desk
from server.flying.in_flight.home_desk import HomeDesk
from server.flying.in_flight.way_desk import WayDesk
from server.heard.channel import Channel
from server.obstacles.obstacle_watch import Watch
from server.obstacles.surroundings import SEEN_BEFORE
from server.schemas import HomeAskedDoc, HomeBody, HomeState, ReturnDoc, SetHomeBody
from server.schemas.flight_docs import CHECK_FRESH_S
from server.work.jobs import Lane
from telemetry.bus.bus import Bus
from telemetry.errors import NotAllowedError
from telemetry.flight.home_watch import home_of
from telemetry.topics.messages import ServerAlive, Topic, VehicleText
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.requests import SetHome
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told
from tests.server.flying_desk_bench import ME, Made, Vehicle
from tests.server.obstacle_messages import delta

pytestmark = pytest.mark.xdist_group("flying-desk")


FAR = {"east_m": 0.0, "north_m": 80.0}
LONG_S = 600.0
"""Positions are of now for so long: a busy machine judges slowly."""


class Bench:
    """A vehicle that took off at the plan's home and hovers 30 m above it."""

    def __init__(self, made: Made, lane: Lane, *, up_m: float = 30.0, bus: Any = None) -> None:
        self.made, self.vehicle, self.document = made, Vehicle(), made.document
        self.told: list[HomeState] = []
        me: Any = self
        self.live = Channel("live", Told())
        stands, now_s = made.standing(), time.monotonic() + LONG_S
        flies = {"armed": True, "landed": "in_air", "alt_rel_home_m": up_m} if up_m else {}
        self.live.state = replace(stands, position_t_mono_s=now_s, gnss_t_mono_s=now_s, **flies)
        self.live.track.states = [stands, self.live.state]
        self.watch = Watch("live", Told())
        for mirror in self.watch.mirrors.values():
            mirror.on_flight(flies=up_m > 0.0)
        ways = WayDesk(me.vehicle, self.live, me, made.library, lane, self.watch, Told())
        self.sets = 0
        self.said: list[str] = []
        on: Any = bus or SimpleNamespace(publish=self.hears)
        self.desk = HomeDesk(me.vehicle, self.live, ways, lane, me, lambda: ME, self.home_set, on)

    def hears(self, topic: Topic, text: VehicleText) -> None:
        assert (topic, text.severity) == (Topic.TEXT, home_desk.CRITICAL)
        self.said.append(text.text)

    def home_set(self) -> None:
        self.sets += 1

    def publish(self, message: Any) -> None:
        self.told.append(message.home)

    @property
    def state(self) -> VehicleState:
        assert self.live.state is not None
        return self.live.state

    def moves(self, east_m: float, up_m: float = 0.0) -> None:
        """Home, by whomever."""
        home = home_of(self.state)
        assert home is not None
        lat_deg, lon_deg = moved_deg((home.lat_deg, home.lon_deg), east_m, 0.0)
        told = {"home_lat_deg": lat_deg, "home_lon_deg": lon_deg, "home_alt_amsl_m": home.alt_amsl_m + up_m}
        self.live.state = replace(self.state, **told)
        self.desk.on_state(self.state)

    async def asked(self, east_m: float | None = None) -> HomeAskedDoc:
        place = None
        if east_m is not None:
            there = self.made.standing(east_m=east_m)
            place = {"lat_deg": there.lat_deg, "lon_deg": there.lon_deg}
        doc = (await self.desk.judge(ME, HomeBody.model_validate({"place": place}))).asked
        assert doc is not None
        return doc


async def shows(there: Callable[[], object]) -> None:
    async with asyncio.timeout(60.0):
        while not there():
            await asyncio.sleep(0.02)


def test_home_there_lies_on_the_models_ground_and_is_set_as_it_was_judged(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
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
        bench = Bench(made, lane, up_m=0.0)
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
        bench = Bench(made, lane)
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
        stands = Bench(made, lane, up_m=0.0)
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
        bench = Bench(made, lane)
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
        bench = Bench(made, lane)
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
        bench = Bench(made, lane)
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
        bench = Bench(made, lane)
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
        bench = Bench(made, lane)
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
        bench = Bench(made, lane, up_m=up_m)
        doc = await bench.asked(20.0 if up_m else None)
        bench.live.state = replace(bench.state, armed=True, landed="on_ground" if up_m else "in_air")
        with pytest.raises(CheckNeededError, match="has landed since" if up_m else "has taken off since"):
            await bench.desk.set(ME, SetHomeBody(id=doc.id))
        assert bench.vehicle.told == []

    runner.run(scenario())


def test_a_return_is_judged_by_what_the_vehicle_holds_now_and_its_verdict_is_gone_at_once(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        bench.vehicle.parameters = {}
        judging = asyncio.ensure_future(bench.desk.run())
        try:
            bench.desk.on_state(bench.state)
            bench.moves(20.0)
            await shows(lambda: bench.desk.state.ret)
            first = bench.desk.state.ret
            assert first is not None
            assert first.state == "not_certified", "no return height is told"
            bench.vehicle.parameters = {"RTL_ALT": 6000.0}
            bench.desk.on_changed()
            assert bench.desk.state.ret is not None
            assert bench.desk.state.ret.state == "unknown"
            await shows(lambda: bench.desk.state.ret and bench.desk.state.ret.state != "unknown")
            assert "return_unknown" not in [reason.code for reason in bench.desk.state.ret.reasons]
            bench.moves(10.0)
            assert [reason.text for reason in bench.desk.state.ret.reasons] == ["Home has moved again."]
        finally:
            judging.cancel()

    runner.run(scenario())


def test_a_certified_return_is_judged_again_where_sensors_see_something_in_its_way_and_that_is_said(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        monkeypatch.setattr(home_desk, "NEW_MAP_S", 0.0)
        monkeypatch.setattr(home_desk, "LOOK_EVERY_S", 0.02)
        monkeypatch.setattr(home_desk, "PAUSE_SHARE", 0.0)  # a first judgement takes long: its worker starts
        bench = Bench(made, lane)
        radar = bench.watch.mirrors["radar"]
        home = home_of(bench.state)
        assert home is not None
        origin = MapOrigin(home.lat_deg, home.lon_deg, home.alt_amsl_m)
        # Far from the way home, and a mast on it that is higher than the return.
        aside = [(-300, -300, up) for up in range(4)]
        mast = [(east, north, up) for east in (9, 10) for north in (-1, 0) for up in range(80)]
        radar.fold(delta(aside, whole=True, revision=1, origin=origin, resolution_m=1.0))
        judging = asyncio.ensure_future(bench.desk.run())
        try:
            bench.desk.on_state(bench.state)
            bench.moves(20.0)
            await shows(lambda: bench.desk.state.ret)
            first = bench.desk.state.ret
            assert first is not None
            assert first.state == "certified", first.reasons
            told = len(bench.told)
            radar.fold(delta(aside, probability=250, since=1, revision=2, origin=origin, resolution_m=1.0))
            await shows(lambda: bench.desk._judged and bench.desk._judged.maps[0] == radar.folds)
            assert (bench.desk.state.ret, len(bench.told)) == (first, told), "it is the same that is seen"
            radar.fold(delta(mast, since=2, revision=3, origin=origin, resolution_m=1.0))
            await shows(lambda: bench.desk.state.ret != first)
            second = bench.desk.state.ret
            assert second is not None
            assert second.state == "not_certified"
            assert second.judged_mono_s > first.judged_mono_s
            (said,) = bench.said
            assert said.startswith("Ground station: the vehicle's return was certified, and is not any more: ")
            assert second.reasons[0].text in said
            # The radar's node is started again: its map is empty, and the mast stands where it stood.
            radar.fold(delta([], whole=True, revision=0, origin=origin, resolution_m=1.0, began_mono_s=50.0))
            await shows(lambda: bench.desk._judged and bench.desk._judged.maps[0] == radar.folds)
            again = bench.desk.state.ret
            assert again is not None
            assert (again.state, again.reasons, radar.kept_count) == (second.state, second.reasons, 324)
            # Home moves, and every map begins anew around it.
            elsewhere = MapOrigin(home.lat_deg, home.lon_deg + 1e-3, home.alt_amsl_m)
            radar.fold(delta([], whole=True, revision=0, origin=elsewhere, resolution_m=1.0, began_mono_s=60.0))
            await shows(lambda: bench.desk._judged and bench.desk._judged.maps[0] == radar.folds)
            assert bench.desk.state.ret is not None
            assert bench.desk.state.ret.state == "not_certified"
            # The radar looks there again, and sees nothing: that frees nothing. The operator empties the maps.
            radar.fold(delta(mast, 20, whole=True, revision=1, origin=origin, resolution_m=1.0, began_mono_s=70.0))
            await shows(lambda: bench.desk._judged and bench.desk._judged.maps[0] == radar.folds)
            assert bench.desk.state.ret.state == "not_certified"
            await bench.watch.dismiss(1)
            await shows(lambda: bench.desk.state.ret and bench.desk.state.ret.state == "certified")
            assert len(bench.said) == 1
        finally:
            judging.cancel()

    runner.run(scenario())


def test_while_parts_of_a_map_are_missing_the_return_is_unknown_at_once_and_judged_once_they_are_there(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        monkeypatch.setattr(home_desk, "LOOK_EVERY_S", 0.02)
        bench = Bench(made, lane)
        radar, home = bench.watch.mirrors["radar"], home_of(bench.state)
        assert home is not None
        origin = MapOrigin(home.lat_deg, home.lon_deg, home.alt_amsl_m)
        aside = delta([(-300, -300, 0)], whole=True, origin=origin, parts=2)
        judging = asyncio.ensure_future(bench.desk.run())
        try:
            bench.desk.on_state(bench.state)
            bench.moves(20.0)
            await shows(lambda: bench.desk.state.ret and not bench.desk.state.is_judging_return)
            radar.fold(aside)
            await shows(lambda: bench.desk.state.ret and bench.desk.state.ret.state == "unknown")
            assert bench.desk.state.ret is not None
            assert bench.desk.state.ret.reasons[0].text.startswith("Parts of a map are missing")
            assert bench.desk.state.is_judging_return, "it waits for them"
            assert bench.said == []
            radar.fold(replace(aside, part=1))
            await shows(lambda: bench.desk.state.ret and bench.desk.state.ret.state == "certified")
            # What never comes leaves it unknown, and that is said.
            monkeypatch.setattr("server.obstacles.surroundings.COMES_WITHIN_S", 0.0)
            radar.fold(replace(aside, revision=2))
            await shows(lambda: bench.said)
            assert "Parts of the radar map have been missing" in bench.said[0]
            radar.fold(replace(aside, revision=2, part=1))
            await shows(lambda: bench.desk.state.ret and bench.desk.state.ret.state == "certified")
        finally:
            judging.cancel()

    runner.run(scenario())


def test_what_was_waited_for_is_no_time_of_the_worker(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench, now_s = Bench(made, lane), [time.monotonic()]
        monkeypatch.setattr("server.flying.in_flight.home_desk.time.monotonic", lambda: now_s[0])
        asked = await bench.desk._ways.asked(ME, home_desk.ANYWHERE)

        async def renewed(_: object) -> Any:
            now_s[0] += 9.0
            return asked

        async def call(*_: object) -> tuple[ReturnDoc, None]:
            now_s[0] += 2.0
            return ReturnDoc(state="certified", reasons=[], judged_mono_s=now_s[0]), None

        async def noted(ret: ReturnDoc, *_: object) -> ReturnDoc:
            now_s[0] += 1.0  # looking along it is work, too
            return ret

        monkeypatch.setattr(bench.desk._ways, "renewed", renewed)
        monkeypatch.setattr(bench.desk, "_lane", SimpleNamespace(call=call))
        monkeypatch.setattr(bench.desk, "_noted", noted)
        await bench.desk._judge_return()
        assert bench.desk._judged is not None
        assert bench.desk._judged.took_s == pytest.approx(3.0)

    runner.run(scenario())


def test_what_looks_all_the_time_has_it_judged_seldom(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench, now_s = Bench(made, lane), time.monotonic()
        ret = ReturnDoc(state="certified", reasons=[], judged_mono_s=now_s)
        home = home_of(bench.state)
        assert home is not None
        bench.desk._gathered = await WayDesk.asked(bench.desk._ways, ME, home_desk.ANYWHERE)
        bench.desk._judged = home_desk._Judged(home, (0.0, 0.0), ret, (1, 0, 0), took_s=4.0)
        looks = list[float]()

        async def seen(_: object) -> bool:
            looks.append(time.monotonic())
            return True

        monkeypatch.setattr(bench.desk._ways, "has_seen_other", seen)
        for later_s, due in ((4.0, False), (11.0, False), (12.5, True)):
            monkeypatch.setattr(time, "monotonic", lambda at_s=now_s + later_s: at_s)
            assert await bench.desk._is_seen_otherwise() is due
        assert looks == [now_s + 12.5]

    runner.run(scenario())


def test_what_nobody_foresaw_leaves_the_return_unknown_and_the_server_running(
    made: Made, lane: Lane, runner: asyncio.Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = Bench(made, lane)
        monkeypatch.setattr(bench.vehicle, "call", lambda request: 1 / 0)
        judging = asyncio.ensure_future(bench.desk.run())
        try:
            bench.desk.on_state(bench.state)
            bench.moves(20.0)
            await shows(lambda: bench.desk.state.ret)
            assert bench.desk.state.ret is not None
            assert bench.desk.state.ret.state == "unknown"
            assert "server's own error" in bench.desk.state.ret.reasons[0].text
            assert not judging.done()
        finally:
            judging.cancel()

    runner.run(scenario())


def test_what_the_station_says_of_the_return_is_on_the_bus_for_the_recorder_and_the_pages(
    made: Made, lane: Lane, runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        server, recorder = await Bus.open(tmp_path, "server"), await Bus.open(tmp_path, "recorder")
        try:
            heard = [bus.subscribe("**", keep_all=True) for bus in (server, recorder)]
            async with asyncio.timeout(60.0):
                # Texts are not kept for late readers: a kept message shows that the way to each is open.
                server.publish(Topic.SERVER, ServerAlive(0.0, 1))
                for subscription in heard:
                    await anext(subscription)
                bench = Bench(made, lane, bus=server)
                bench.desk._holds = True
                bench.desk._say_if_lost(ReturnDoc(state="not_certified", reasons=[], judged_mono_s=0.0))
                for subscription in heard:
                    while (said := await anext(subscription))[0] != Topic.TEXT:
                        pass  # the kept message may come once more
                    assert isinstance(said[1], VehicleText)
                    assert said[1].text == f"{home_desk.NO_MORE}."
        finally:
            await server.close()
            await recorder.close()

    runner.run(scenario())
