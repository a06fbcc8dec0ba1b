"""Maps that are told to pages: parts that are missing are asked for, what is lost is said, what was seen counts."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mapping.voxels.map import VoxelMap
from server.errors import NotReadyError
from server.obstacles.obstacle_watch import DEAD_S, LATE_S, Watch
from server.obstacles.surroundings import are_maps_whole, seen_maps
from telemetry.perception.map_changes import ChangeTeller
from telemetry.topics.obstacles import Basis, FlightMapStatus
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Clock, Told, watching
from tests.server.obstacle_messages import ORIGIN, delta, status


def test_broken_parts_of_a_map_hurt_nobody_and_missing_ones_are_asked_for() -> None:
    watch, _, _ = watching()

    async def hear() -> None:
        await watch.on_map(delta([(0, 0, 0)], whole=True, revision=3))
        await watch.on_map(replace(delta([(1, 0, 0)], revision=4, since=3), keys=b"123"))
        assert not watch.needs_whole["radar"].is_set()
        await watch.on_map(delta([(1, 0, 0)], revision=9, since=8))

    asyncio.run(hear())
    assert watch.needs_whole["radar"].is_set()
    assert watch.mirrors["radar"].voxel_count == 2


def test_a_map_that_was_there_before_is_asked_for() -> None:
    watch, _, _ = watching()
    watch.on_status(status(voxels_occupied=0))
    assert not watch.needs_whole["radar"].is_set()
    watch.on_status(status(voxels_occupied=12))
    assert watch.needs_whole["radar"].is_set()


def test_the_cameras_map_of_the_flight_is_a_map_of_its_own() -> None:
    watch, _, _ = watching()
    asyncio.run(watch.on_map(delta([(0, 0, 0)], sensor="vision_flight")))
    assert watch.mirrors["vision_flight"].voxel_count == 1
    assert watch.mirrors["vision"].voxel_count == 0
    watch.on_status(status("vision", flight_map=FlightMapStatus(1, 100)))
    assert not watch.needs_whole["vision"].is_set()
    watch.forget()
    watch.on_status(status("vision", flight_map=FlightMapStatus(1, 100)))
    assert watch.needs_whole["vision"].is_set()


CRANE = [(4, 0, 20)]


def test_a_map_that_begins_anew_in_flight_is_said_and_what_it_had_seen_counts_until_the_landing() -> None:
    async def scenario() -> None:
        watch, told, _ = watching()
        await watch.on_flight(flies=False)
        await watch.on_flight(flies=True)
        await watch.on_map(delta(CRANE, whole=True, began_mono_s=1.0))
        assert not watch.state.alerts
        await watch.on_map(delta([], whole=True, revision=0, began_mono_s=2.0))
        (began,) = [each.alert for each in watch.state.alerts]
        assert began.text.startswith("The radar map began anew: what it had seen counts")
        assert began.text.endswith("until the landing, or until you empty the maps.")
        assert sum(len(voxels.keys) for voxels in await seen_maps(watch)) == 1
        await watch.on_flight(flies=False)
        assert [message.alert.text for message in told if message.type == "alert"][-1].startswith("Nothing that")
        assert sum(len(voxels.keys) for voxels in await seen_maps(watch)) == 0

    asyncio.run(scenario())


def test_a_map_that_is_just_being_told_is_waited_for_but_not_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario() -> None:
        watch, _, clock = watching()
        await watch.on_map(delta(CRANE, whole=True, parts=2))
        looking = asyncio.ensure_future(seen_maps(watch))
        await watch.on_map(delta([(5, 0, 20)], whole=True, part=1, parts=2))
        (seen,) = await looking
        assert len(seen.keys) == 2
        await watch.on_map(delta(CRANE, whole=True, parts=2, revision=2))
        monkeypatch.setattr("server.obstacles.surroundings.COMES_WITHIN_S", 0.0)
        with pytest.raises(NotReadyError, match="Parts of the radar map have been missing"):
            await seen_maps(watch)
        watch.on_status(status())
        assert not watch.needs_whole["radar"].is_set(), "the rest may be on its way"
        clock.now_s += LATE_S + 0.1
        watch.on_status(status())
        assert watch.needs_whole["radar"].is_set()

    asyncio.run(scenario())


def test_what_could_not_be_kept_is_said_and_leaves_the_way_unknown_until_the_maps_are_emptied(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def scenario() -> None:
        watch, told, _ = watching()
        await watch.on_flight(flies=False)
        await watch.on_flight(flies=True)
        monkeypatch.setattr("server.scene.kept_voxels.MOST_VOXELS", 0)
        await watch.on_map(delta(CRANE, whole=True, began_mono_s=1.0))
        await watch.on_map(delta([], whole=True, revision=0, began_mono_s=2.0))
        (said,) = [each.alert for each in watch.state.alerts]
        assert said.text.startswith("Not all that the radar had seen before its map began anew could be kept")
        with pytest.raises(NotReadyError, match="not all that it had seen could be kept") as refused:
            await seen_maps(watch)
        assert refused.value.advice.startswith("It counts again after the landing, or once you empty the maps.")
        assert "steer clear" in refused.value.advice
        await watch.dismiss(1)
        assert [message.alert.phase for message in told if message.type == "alert"] == ["begins", "ends"]
        assert await seen_maps(watch) == ()

    asyncio.run(scenario())


@pytest.mark.parametrize("ends", ["landing", "emptying"])
def test_half_a_map_of_a_node_that_does_not_come_back_blocks_no_longer_than_the_flight(
    ends: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        watch, _, clock = watching()
        monkeypatch.setattr("server.obstacles.surroundings.COMES_WITHIN_S", 0.0)
        await watch.on_flight(flies=False)
        await watch.on_flight(flies=True)
        watch.on_status(status())
        await watch.on_map(delta(CRANE, whole=True, parts=2))
        with pytest.raises(NotReadyError) as refused:
            await seen_maps(watch)
        assert refused.value.advice.startswith("They are asked for; ask again.")
        clock.now_s += DEAD_S + 0.1
        with pytest.raises(NotReadyError, match="and its node does not run") as refused:
            await seen_maps(watch)
        assert "asked for" not in refused.value.advice
        assert "once you empty the maps" in refused.value.advice
        await (watch.on_flight(flies=False) if ends == "landing" else watch.dismiss(1))
        assert await seen_maps(watch) == ()
        assert not watch.needs_whole["radar"].is_set(), "nobody would answer"
        watch.on_status(status(voxels_occupied=3))
        assert watch.needs_whole["radar"].is_set()

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("state", "in_flight"),
    [
        (VehicleState(1, 1, heartbeat_t_mono_s=1.0), False),
        (VehicleState(1, 1, heartbeat_t_mono_s=1.0, armed=True, landed="in_air"), True),
        (VehicleState(1, 1), True),  # it has not said whether it flies
        (None, True),
    ],
)
def test_only_of_a_vehicle_that_may_fly_it_is_said_to_hold_or_to_steer_clear(
    state: VehicleState | None, *, in_flight: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        vehicle: Any = SimpleNamespace(state=state)
        clock = Clock()
        watch = Watch("live", Told(), vehicle, now_mono_s=clock)
        monkeypatch.setattr("server.obstacles.surroundings.COMES_WITHIN_S", 0.0)
        watch.on_status(status())
        await watch.on_map(delta(CRANE, whole=True, parts=2))
        with pytest.raises(NotReadyError) as refused:
            await seen_maps(watch)
        assert refused.value.advice.startswith("They are asked for; ask again.")
        assert ("steer clear" in refused.value.advice) is in_flight
        clock.now_s += DEAD_S + 0.1
        with pytest.raises(NotReadyError) as refused:
            await seen_maps(watch)
        words = refused.value.advice
        assert "empty the maps" in words
        assert ("steer clear" in words, "landing" in words) == (in_flight, in_flight)

    asyncio.run(scenario())


def test_maps_that_can_not_be_told_yet_are_not_waited_for() -> None:
    """A camera whose path is not laid over the vehicle's yet; a node that knows no home."""
    cases: list[dict[str, Any]] = [{"placed": False}, {"origin": None}]
    for not_yet in cases:
        watch, _, _ = watching()
        watch.on_status(status("vision", voxels_occupied=40, flight_map=FlightMapStatus(1, 100), **not_yet))
        assert asyncio.run(seen_maps(watch)) == ()
        watch.on_status(status("vision", voxels_occupied=40))
        assert watch.mirrors["vision"].seen() is None


def test_a_map_that_died_unheard_is_said_to_be_lost() -> None:
    async def scenario() -> None:
        watch, _, _ = watching()
        await watch.on_flight(flies=False)
        await watch.on_flight(flies=True)
        watch.on_status(status(voxels_occupied=3, basis=Basis(10.0, run="a")))
        assert not watch.state.alerts
        watch.on_status(status(voxels_occupied=1, basis=Basis(14.0, run="b")))
        (said,) = [each.alert for each in watch.state.alerts]
        assert said.text.startswith("Not all that the radar had seen before its map began anew could be kept")
        await watch.on_map(delta(CRANE, whole=True, began_mono_s=9.0))
        with pytest.raises(NotReadyError, match="not all that it had seen could be kept"):
            await seen_maps(watch)
        await watch.dismiss(1)
        for t_mono_s, clear_count in ((20.0, 0), (21.0, 1)):
            said = Basis(t_mono_s, run="b")
            watch.on_status(status(voxels_occupied=3, clear_count=clear_count, basis=said))
            assert not watch.mirrors["radar"].has_forgotten
        watch.on_status(status(voxels_occupied=1, clear_count=1, basis=Basis(24.0, run="c")))
        assert watch.mirrors["radar"].has_forgotten, "seen since the maps were emptied"

    asyncio.run(scenario())


def test_a_server_that_begins_in_flight_waits_for_each_running_node_and_says_what_may_be_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def scenario() -> None:
        watch, told, _ = watching()
        monkeypatch.setattr("server.obstacles.surroundings.COMES_WITHIN_S", 0.0)
        watch.awaited |= {"radar", "vision"}
        await watch.on_flight(flies=True)
        (said,) = [each.alert for each in watch.state.alerts]
        assert "was in the air when this server heard it first" in said.text
        assert not are_maps_whole(watch)
        with pytest.raises(NotReadyError, match="Parts of the radar map"):
            await seen_maps(watch)
        watch.on_status(status(voxels_occupied=1))
        watch.on_status(status("vision", voxels_occupied=0))
        assert watch.needs_whole["radar"].is_set()
        await watch.on_map(delta(CRANE, whole=True, revision=6, began_mono_s=1.0))
        assert are_maps_whole(watch)
        assert [len(voxels.keys) for voxels in await seen_maps(watch)] == [1]
        await watch.on_flight(flies=False)
        await watch.on_flight(flies=True)
        assert [message.alert.phase for message in told if message.type == "alert"] == ["begins", "ends"]

    asyncio.run(scenario())


def test_a_node_that_is_started_again_loses_nothing_and_a_local_map_that_is_laid_anew_keeps_nothing() -> None:
    async def scenario() -> None:
        watch, _, _ = watching()
        await watch.on_flight(flies=True)

        async def tells(teller: ChangeTeller, the_map: VoxelMap, t_mono_s: float, *points: tuple[float, ...]) -> None:
            known = np.zeros(len(points), np.bool_)
            the_map.insert(np.array(points), origin_enu=np.zeros(3), max_range_m=50.0, explained=known)
            for part in teller.changes(the_map, ORIGIN, t_mono_s):
                await watch.on_map(part)

        teller, the_map = ChangeTeller("radar", 0.0), VoxelMap(resolution_m=1.0)
        for t_mono_s in (10.0, 11.0, 12.0):
            await tells(teller, the_map, t_mono_s, (4.5, 0.5, 20.5))
        the_map.clear()
        await tells(teller, the_map, 13.0, (8.5, 0.5, 20.5))
        assert [voxels.keys.tolist() for voxels in await seen_maps(watch)] == [[[8, 0, 20]]]
        await tells(ChangeTeller("radar", 0.0), VoxelMap(resolution_m=1.0), 14.0, (1.5, 0.5, 3.5))
        assert [voxels.keys.tolist() for voxels in await seen_maps(watch)] == [[[1, 0, 3]], [[8, 0, 20]]]

    asyncio.run(scenario())
