"""What pages are told of obstacles: alerts at once, statuses at their pace, silence, nothing of another recording."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from server.obstacles.obstacle_watch import DEAD_S, Watch
from server.stations import Flying
from telemetry.topics.obstacles import AvoidanceStatus
from tests.server.fakes import Clock, Told, watching
from tests.server.obstacle_messages import alert, delta, status


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
