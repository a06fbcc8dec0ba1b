"""Who takes over: modes that nobody here asked for, sticks, and other hands on the vehicle."""

from __future__ import annotations

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.flight.avoidance.pilot_watch import ASKED_S, PilotWatch
from telemetry.topics.vehicle import VehicleState


def state(mode: str, *, critical: bool = False) -> VehicleState:
    return VehicleState(1, 1, mode=mode, armed=True, critical=critical)


def channels(*sticks_us: int) -> Any:
    values: list[int] = [0, 8, *sticks_us, *[1500] * (18 - len(sticks_us)), 255]
    return wire.MAVLink_rc_channels_message(*values)


def after(*modes: str, asked: dict[str, float] | None = None, at_s: float = 100.0) -> PilotWatch:
    watch = PilotWatch()
    for mode, t_s in (asked or {}).items():
        watch.asked(mode, t_s)
    for mode in modes:
        watch.on_state(state(mode), at_s)
    return watch


def test_only_modes_that_were_asked_for_lately_are_ours() -> None:
    assert after("AUTO", "AUTO").words == ""
    assert "LOITER" in after("AUTO", "LOITER").words
    assert after("AUTO", "BRAKE", "GUIDED", asked={"BRAKE": 99.0, "GUIDED": 99.5}).words == ""
    assert after("AUTO", "BRAKE", asked={"BRAKE": 80.0}).words
    assert after("AUTO", "BRAKE", "AUTO", "BRAKE", asked={"BRAKE": 99.0}).words


def test_each_order_of_a_mode_is_expected_to_show_once() -> None:
    """On a slow link the first of them shows when the last was given long ago."""
    watch = after("AUTO")
    for mode, t_s in (("GUIDED", 100.0), ("BRAKE", 101.0), ("GUIDED", 101.5)):
        watch.asked(mode, t_s)
    for mode, t_s in (("GUIDED", 102.0), ("BRAKE", 102.5), ("GUIDED", 103.0)):
        watch.on_state(state(mode), t_s)
    assert watch.words == ""
    watch.on_state(state("BRAKE"), 103.5)
    assert "BRAKE" in watch.words


def test_orders_whose_mode_never_shows_are_forgotten() -> None:
    watch = after("AUTO")
    for second in range(1000):
        watch.asked("GUIDED" if second % 2 else f"MODE {second}", float(second))
    assert watch.expected == ASKED_S + 1


@pytest.mark.parametrize(("shown_again_s", "is_ours"), [(2.0, True), (4.0, False)])
def test_a_repeated_order_does_not_excuse_a_pilot_for_long(shown_again_s: float, is_ours: bool) -> None:
    watch = after("AUTO")
    for mode in ("GUIDED", "GUIDED", "AUTO"):
        watch.asked(mode, 100.0)
    for mode, t_s in (("GUIDED", 100.5), ("AUTO", 101.0), ("GUIDED", 100.5 + shown_again_s)):
        watch.on_state(state(mode), t_s)
    assert (watch.words == "") == is_ours


def test_a_failsafe_is_named() -> None:
    watch = after("AUTO")
    watch.on_state(state("RTL", critical=True), 101.0)
    assert "failsafe" in watch.words


def test_another_flight_begins_anew() -> None:
    watch = after("AUTO", "LOITER")
    watch.begin()
    watch.on_state(state("AUTO"), 101.0)
    assert watch.words == ""


@pytest.mark.parametrize(
    ("second", "moved"),
    [
        ((1500, 1500, 1100, 1500), False),
        ((1560, 1440, 1150, 1500), False),
        ((1500, 1500, 1100, 1650), True),
        ((1500, 1350, 1100, 1500), True),
        ((0, 0, 0, 0), False),
        ((65535, 1500, 1100, 1500), False),
        ((1500, 1500, 900, 1500), False),
    ],
)
def test_a_stick_that_leaves_its_place_is_seen(second: tuple[int, ...], moved: bool) -> None:
    watch = PilotWatch()
    watch.on_message(channels(1500, 1500, 1100, 1500))
    watch.on_message(channels(*second))
    assert bool(watch.words) is moved


def test_other_hands_count_only_when_they_steer() -> None:
    watch = PilotWatch()
    watch.on_message(wire.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))
    watch.on_message(wire.MAVLink_manual_control_message(1, 32767, 32767, 32767, 32767, 0))
    watch.on_message(wire.MAVLink_rc_channels_override_message(1, 1, *[0] * 8))
    assert watch.words == ""
    watch.on_message(wire.MAVLink_rc_channels_override_message(1, 1, 0, 0, 1600, *[0] * 5))
    assert "by hand" in watch.words
