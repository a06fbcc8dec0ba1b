"""What pages are told of obstacles: alerts at once, statuses at their pace, silence, nothing of another recording."""

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
from server.stations import Flying
from telemetry.perception.map_changes import ChangeTeller
from telemetry.topics.obstacles import AvoidanceStatus, Basis, FlightMapStatus
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told
from tests.server.obstacle_messages import ORIGIN, alert, delta, status


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def watching(source: Any = "live") -> tuple[Watch, list[Any], Clock]:
    told = Told()
    clock = Clock()
    return Watch(source, told, now_mono_s=clock, now_utc_s=lambda: 5000.0), told, clock


def test_an_alert_is_told_at_once_before_the_list_that_holds_it() -> None:
    watch, told, _ = watching()
    watch.on_alert(alert())
    assert [message.type for message in told] == ["alert", "obstacles"]
    assert told[1].obstacles.alerts[0].alert.id == "radar-1"
    watch.acknowledge("radar-1")
    watch.on_alert(alert(phase="ends"))
    assert told[-1].obstacles.alerts == []


def test_avoidance_that_loses_its_eyes_in_flight_is_alerted_at_once_until_it_sees_or_is_off() -> None:
    told = Told()
    vehicle: Any = SimpleNamespace(in_air=True)
    watch = Watch("live", told, vehicle, now_mono_s=Clock(), now_utc_s=lambda: 5000.0)
    sees = AvoidanceStatus(enabled=True, state="watching", sensors=("vision",))
    blind = AvoidanceStatus(enabled=True, state="blind")
    watch.on_avoidance(sees)
    watch.on_avoidance(blind)
    (lost,) = [each.alert for each in watch.state.alerts]
    assert (lost.kind, lost.sensor, lost.phase) == ("avoidance", "vision", "begins")
    assert "sees nothing any more" in lost.text
    watch.on_avoidance(replace(blind, text="still"))
    assert len([message for message in told if message.type == "alert"]) == 1
    watch.on_avoidance(sees)
    assert [message.alert.text for message in told if message.type == "alert"][-1] == "Avoidance sees again."
    vehicle.in_air = False
    watch.on_avoidance(blind)
    assert len([message for message in told if message.type == "alert"]) == 2


def test_a_vehicle_that_has_landed_is_not_told_to_steer_clear() -> None:
    told = Told()
    vehicle: Any = SimpleNamespace(in_air=True)
    watch = Watch("live", told, vehicle, now_mono_s=Clock(), now_utc_s=lambda: 5000.0)
    asyncio.run(watch.on_flight(flies=True))
    watch.on_avoidance(AvoidanceStatus(enabled=True, state="blind"))
    assert [doc.over for doc in watch.state.alerts if doc.alert.kind == "avoidance"] == [False]
    vehicle.in_air = False
    asyncio.run(watch.on_flight(flies=False))
    watch.on_avoidance(AvoidanceStatus(enabled=True, state="blind"))
    said = [message.alert for message in told if message.type == "alert" and message.alert.kind == "avoidance"]
    assert [(alert.phase, alert.text) for alert in said[1:]] == [("ends", "The flight is over.")]


def test_avoidance_is_gone_with_the_link_process_and_back_with_its_word() -> None:
    told = Told()
    vehicle: Any = SimpleNamespace(in_air=True)
    watch = Watch("live", told, vehicle, now_mono_s=Clock(), now_utc_s=lambda: 5000.0)
    watch.on_link_process(answers=False)
    assert watch.state.avoidance.state == "off", "it was off before"
    watch.on_link_process(answers=True)
    sees = AvoidanceStatus(enabled=True, state="watching", sensors=("radar",), largest_speed_m_s=5.8)
    watch.on_avoidance(sees)
    watch.on_link_process(answers=False)
    assert watch.state.avoidance.state == "lost"
    assert watch.state.avoidance.largest_speed_m_s is None, "it sees far enough for no speed"
    (gone,) = [each.alert for each in watch.state.alerts]
    assert (gone.kind, gone.phase) == ("avoidance", "begins")
    assert "transmitter" in gone.text
    watch.on_link_process(answers=True)
    assert watch.state.avoidance == sees
    assert [message.alert.phase for message in told if message.type == "alert"] == ["begins", "ends"]
    watch.on_link_process(answers=False)
    watch.on_avoidance(AvoidanceStatus())
    assert watch.state.avoidance.state == "off", "what comes up without it is off, whatever was on before"


@pytest.mark.parametrize(
    ("says", "over"),
    [
        (AvoidanceStatus(enabled=True, state="watching", sensors=("radar",)), "Avoidance sees again."),
        (AvoidanceStatus(), "Avoidance is off."),
        (AvoidanceStatus(enabled=True, state="lost", text="not heard yet"), None),
    ],
)
@pytest.mark.parametrize("is_early", [False, True], ids=["once it runs", "before it is known to run"])
def test_the_loss_of_a_link_that_was_killed_ends_with_the_next_one_s_own_word(
    says: AvoidanceStatus, over: str | None, *, is_early: bool
) -> None:
    told = Told()
    vehicle: Any = SimpleNamespace(in_air=True)
    watch = Watch("live", told, vehicle, now_mono_s=Clock(), now_utc_s=lambda: 5000.0)
    watch.on_avoidance(AvoidanceStatus(enabled=True, state="watching", sensors=("radar",), largest_speed_m_s=5.8))
    watch.on_link_process(answers=False)
    watch.on_link_process(answers=False, has_ended=True)
    if is_early:
        watch.on_avoidance(says)
    watch.on_link_process(answers=True)
    if not is_early:
        assert (watch.state.avoidance.state, watch.state.avoidance.largest_speed_m_s) == ("lost", None)
        assert [doc.over for doc in watch.state.alerts] == [False]
        watch.on_avoidance(says)
    assert watch.state.avoidance == says
    said = [message.alert for message in told if message.type == "alert"]
    assert [alert.text for alert in said[1:]] == ([] if over is None else [over])


def test_a_link_that_only_hung_goes_on_with_its_word_and_one_that_ended_does_not() -> None:
    async def scenario() -> None:
        heard: list[tuple[bool, bool]] = []
        nodes = SimpleNamespace(changed=asyncio.Event(), link_answers=True, link_restarts=2)
        watch = SimpleNamespace(on_link_process=lambda *, answers, has_ended: heard.append((answers, has_ended)))
        station: Any = SimpleNamespace(nodes=nodes, _watch=watch, live=SimpleNamespace(armed=False))
        hearing = asyncio.create_task(Flying._hear_of_nodes(station))
        try:
            for answers, restarts in ((False, 2), (True, 2), (False, 2), (False, 3), (True, 3), (True, 4), (True, 0)):
                await asyncio.sleep(0)
                nodes.link_answers, nodes.link_restarts = answers, restarts
                nodes.changed.set()
                while nodes.changed.is_set():
                    await asyncio.sleep(0)
        finally:
            hearing.cancel()
        hung_and_back, killed, at_once = [(False, False), (True, False)], [(False, False), (False, True)], (True, True)
        stopped = True, False
        assert heard == [*hung_and_back, *killed, (True, False), at_once, stopped]

    asyncio.run(scenario())


def test_an_alert_is_new_once() -> None:
    watch, _, _ = watching()
    phases = ("begins", "goes_on", "goes_on", "ends")
    assert [watch.on_alert(alert(phase=phase)) for phase in phases] == [True, False, False, False]


def test_statuses_go_out_at_ten_hertz_and_a_change_of_state_at_once() -> None:
    watch, told, clock = watching()
    for _ in range(100):
        watch.on_status(status())
        clock.now_s += 0.02
    assert 15 <= len(told) <= 26
    del told[:]
    watch.on_status(replace(status(), state="blind"))
    assert [message.status.state for message in told] == ["blind"]


def test_a_node_that_died_is_alerted_and_its_return_ends_that() -> None:
    watch, told, clock = watching()
    watch.on_status(status())
    watch.on_status(status("vision"))
    watch.on_alert(alert())
    clock.now_s += DEAD_S + 0.1
    watch.on_status(status("vision"))
    del told[:]
    watch.tick()
    lost = [m.alert for m in told if m.type == "alert"]
    assert [(a.sensor, a.kind, a.phase) for a in lost] == [("radar", "sensor", "begins")]
    watch.tick()
    clock.now_s += 3.0
    watch.tick()
    docs = {doc.alert.id: doc for doc in watch.state.alerts}
    assert docs["radar-1"].over
    assert len([m for m in told if m.type == "alert" and m.alert.sensor == "radar"]) == 1
    watch.on_status(status())
    ended = [m.alert for m in told if m.type == "alert"][-1]
    assert (ended.id, ended.phase, ended.t_utc_s) == (lost[0].id, "ends", 5000.0)


def test_a_sensor_that_never_sent_anything_is_not_missed() -> None:
    watch, told, clock = watching()
    watch.on_status(status(state="waiting"))
    clock.now_s += 100.0
    watch.tick()
    assert [m for m in told if m.type == "alert"] == []


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


def test_of_another_recording_nothing_stays() -> None:
    watch, told, _ = watching("replay")
    asyncio.run(watch.on_map(delta([(0, 0, 0)])))
    watch.on_status(status())
    watch.on_alert(alert())
    del told[:]
    watch.forget()
    assert [(m.sensor, m.status) for m in told if m.type == "perception"] == [("radar", None)]
    assert watch.state.alerts == []
    assert watch.statuses == {}
    assert watch.mirrors["radar"].voxel_count == 0
    assert watch.mirrors["radar"].origin is None


def test_alerts_of_a_node_that_was_started_anew_at_once_end() -> None:
    watch, _, clock = watching()
    ended: list[str] = []
    watch.on_status(status())
    watch.on_alert(alert())
    for _ in range(7):
        clock.now_s += 1.0
        watch.on_status(status())
        ended += watch.tick()
    assert ended == ["radar-1"]
    assert [doc.over for doc in watch.state.alerts] == [True]


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
