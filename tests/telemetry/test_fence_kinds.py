"""FENCE_TYPE that somebody changes while the fence is on: what it names may not act yet, and that is said."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.fence.fence_model import NO_FENCE, Fence
from telemetry.flight.fence_kinds import KindsSeen, untaken_words
from telemetry.flight.preflight.fence_check import fence_row
from telemetry.link.onboard import OnBoard
from telemetry.mavlink.parameters.values import wire_value
from telemetry.topics.onboard_lists import PlacesOnboard

CEILING, CIRCLE, SHAPES, FLOOR = 1, 2, 4, 8
Told = tuple[str, float | None]


def heard(*told: Told) -> KindsSeen:
    seen = KindsSeen()
    for name, value in told:
        seen.take({name: value})
    return seen


@pytest.mark.parametrize(
    ("told", "untaken"),
    [
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("FENCE_TYPE", 7)), CEILING | CIRCLE),
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("FENCE_TYPE", 12)), 0),  # a floor is taken by itself
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 7), ("FENCE_TYPE", 4)), 0),  # fewer act at once
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("FENCE_TYPE", 5), ("FENCE_TYPE", 7)), CEILING | CIRCLE),
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("FENCE_TYPE", 7), ("FENCE_TYPE", 6)), CIRCLE),
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 7)), 0),  # nobody knows what it was
        ((("FENCE_TYPE", 4), ("FENCE_TYPE", 7)), 0),
        ((("FENCE_ENABLE", 0), ("FENCE_TYPE", 4), ("FENCE_TYPE", 7), ("FENCE_ENABLE", 1)), 0),
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("FENCE_TYPE", 7), ("FENCE_ENABLE", 0), ("FENCE_ENABLE", 1)), 0),
        ((("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("FENCE_TYPE", None), ("FENCE_TYPE", 5)), CEILING),
    ],
)
def test_what_is_added_while_it_is_on_is_not_taken_until_it_was_off(told: tuple[Told, ...], untaken: int) -> None:
    assert heard(*told).untaken == untaken


def test_two_readings_with_the_fence_on_in_both_are_the_worse_end() -> None:
    seen = KindsSeen()
    seen.take({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0})
    seen.take({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 5.0})
    assert seen.untaken == CEILING
    seen.take({"FENCE_ENABLE": 0.0, "FENCE_TYPE": 5.0})
    assert seen.untaken == 0


def test_a_vehicle_that_restarted_takes_all_of_them() -> None:
    seen = heard(("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("FENCE_TYPE", 7))
    seen.forget()
    assert seen.untaken == 0
    seen.take({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0})
    assert seen.untaken == 0


def told_by_the_vehicle(name: str, value: float) -> wire.MAVLink_param_value_message:
    return wire.MAVLink_param_value_message(name.encode(), value, 9, 900, 65535)


def test_what_another_station_writes_is_heard_as_the_vehicle_tells_it_to_everybody() -> None:
    aboard = OnBoard()
    for name, value in (("FENCE_ENABLE", 1), ("FENCE_TYPE", 4), ("WPNAV_SPEED", 500), ("FENCE_TYPE", 5)):
        message = told_by_the_vehicle(name, value)
        message.param_id = name
        assert aboard.on_message(message, 100.0) is False
    assert aboard.fence.kinds.untaken == CEILING
    aboard.forget()  # it was silent: it may not have restarted
    assert aboard.fence.kinds.untaken == CEILING
    aboard.forget(restarted=True)
    assert aboard.fence.kinds.untaken == 0


def test_the_check_says_it_and_wants_it_accepted_though_the_parameters_read_as_set() -> None:
    parameters: dict[str, float | None] = {
        "FENCE_ENABLE": 1.0, "FENCE_TYPE": 5.0, "FENCE_ALT_MAX": 60.0, "FENCE_ALT_MIN": -10.0, "FENCE_ACTION": 1.0,
    }  # fmt: skip
    planned = (Fence(ceiling_rel_home_m=60.0), ())
    row = fence_row(planned, PlacesOnboard(), parameters, "ardupilot")
    assert row is not None
    assert row.state == "good"
    row = fence_row(planned, PlacesOnboard(), parameters, "ardupilot", untaken_kinds=CEILING)
    assert row is not None
    assert row.state == "accept"
    assert "given more kinds while the fence is on (ceiling)" in row.text
    assert "Set FENCE_ENABLE to 0 and to 1 again" in row.mend
    other = fence_row((NO_FENCE, ()), PlacesOnboard(), parameters, "ardupilot", untaken_kinds=CEILING | CIRCLE)
    assert other is not None
    assert "(ceiling, circle around home)" in other.text


def test_nothing_is_said_where_nothing_was_added() -> None:
    assert untaken_words(0) == ""
    assert "(shapes)" in untaken_words(SHAPES)


def test_all_of_a_fence_that_is_heard_is_held_against_and_not_its_switch_alone() -> None:
    aboard = OnBoard()
    for name, value in (("FENCE_ENABLE", 1), ("FENCE_TYPE", 1), ("FENCE_ALT_MAX", 40), ("FENCE_ALT_MAX_TP", 1)):
        message = told_by_the_vehicle(name, value)
        message.param_id = name
        aboard.on_message(message, 100.0)
    assert aboard.fence.unread(None) == ""
    assert aboard.fence.highest_m == 40.0


def test_a_px4s_integers_are_heard_as_it_sends_them() -> None:
    aboard = OnBoard()
    int32, real32 = 6, 9
    for name, value, kind in (
        *(("GF_ACTION", 2, int32), ("GF_MAX_HOR_DIST", 0.0, real32)),
        ("GF_MAX_VER_DIST", 30.0, real32),
    ):
        carried = wire_value(value, kind, bytewise=True)
        assert carried is not None
        message = wire.MAVLink_param_value_message(name.encode(), carried, kind, 900, 65535)
        message.param_id = name
        aboard.on_message(message, 100.0, bytewise=True)
    assert aboard.fence.unread(None) == ""
    assert aboard.fence.highest_m == 30.0
