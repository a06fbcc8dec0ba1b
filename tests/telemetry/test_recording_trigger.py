"""When it is recorded."""

from __future__ import annotations

from telemetry.recording.trigger import AFTER_DISARM_S, GONE_S, Trigger
from tests.telemetry.recordings import state_at


def wanted_after(trigger: Trigger, now_s: float, *, armed: bool) -> bool:
    trigger.on_state(state_at(now_s, armed=armed), now_s)
    trigger.on_tick(now_s)
    return trigger.wanted


def test_from_arming_until_a_little_after_disarming() -> None:
    trigger = Trigger()
    assert not wanted_after(trigger, 0.0, armed=False)
    assert wanted_after(trigger, 1.0, armed=True)
    assert wanted_after(trigger, 100.0, armed=True)
    assert wanted_after(trigger, 101.0, armed=False)
    assert wanted_after(trigger, 100.9 + AFTER_DISARM_S, armed=False)
    assert not wanted_after(trigger, 101.0 + AFTER_DISARM_S, armed=False)
    assert wanted_after(trigger, 200.0, armed=True)


def test_arming_again_at_once_is_the_same_flight() -> None:
    trigger = Trigger()
    for now_s, armed in ((0.0, True), (10.0, False), (12.0, True), (12.0 + AFTER_DISARM_S, True)):
        assert wanted_after(trigger, now_s, armed=armed)


def test_a_recorder_that_starts_in_flight_records_at_once() -> None:
    assert wanted_after(Trigger(), 0.0, armed=True)


def test_started_by_hand_it_goes_on_until_stopped_by_hand() -> None:
    trigger = Trigger()
    trigger.start_by_hand()
    for now_s, armed in ((1.0, False), (2.0, True), (30.0, False), (30.0 + 10 * AFTER_DISARM_S, False)):
        assert wanted_after(trigger, now_s, armed=armed)
    trigger.stop_by_hand()
    assert not wanted_after(trigger, 200.0, armed=False)


def test_taken_over_by_hand_in_flight_it_goes_on_after_landing() -> None:
    trigger = Trigger()
    assert wanted_after(trigger, 0.0, armed=True)
    trigger.start_by_hand()
    assert wanted_after(trigger, 10.0, armed=False)
    assert wanted_after(trigger, 11.0 + AFTER_DISARM_S, armed=False)


def test_stopped_by_hand_in_flight_it_waits_for_the_next_arming() -> None:
    trigger = Trigger()
    assert wanted_after(trigger, 0.0, armed=True)
    trigger.stop_by_hand()
    assert not wanted_after(trigger, 1.0, armed=True)
    assert not wanted_after(trigger, 2.0, armed=False)
    assert wanted_after(trigger, 3.0, armed=True)


def test_a_vehicle_that_never_comes_back_ends_it() -> None:
    trigger = Trigger()
    assert wanted_after(trigger, 0.0, armed=True)
    trigger.on_tick(GONE_S - 1.0)
    assert trigger.wanted
    trigger.on_tick(GONE_S)
    assert not trigger.wanted
