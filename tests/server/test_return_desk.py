"""What the station says of Return: judged by what is held and seen now, unknown at once where that is not known."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from server.flying.in_flight import home_desk
from server.flying.in_flight.way_desk import WayDesk
from server.schemas import ReturnDoc
from server.work.jobs import Lane
from telemetry.bus.bus import Bus
from telemetry.flight.home_watch import home_of
from telemetry.topics.messages import ServerAlive, Topic, VehicleText
from telemetry.topics.obstacles import MapOrigin
from tests.server.flying_desk_bench import ME, Made
from tests.server.in_flight_benches import HomeBench, shows
from tests.server.obstacle_messages import delta

pytestmark = pytest.mark.xdist_group("flying-desk")


def test_a_return_is_judged_by_what_the_vehicle_holds_now_and_its_verdict_is_gone_at_once(
    made: Made, lane: Lane, runner: asyncio.Runner
) -> None:
    async def scenario() -> None:
        bench = HomeBench(made, lane)
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
        bench = HomeBench(made, lane)
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
        bench = HomeBench(made, lane)
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
        bench, now_s = HomeBench(made, lane), [time.monotonic()]
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
        bench, now_s = HomeBench(made, lane), time.monotonic()
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
        bench = HomeBench(made, lane)
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
                bench = HomeBench(made, lane, bus=server)
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
