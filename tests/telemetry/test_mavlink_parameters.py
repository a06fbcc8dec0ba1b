"""Reading parameters: both ways of writing integers, what a vehicle does not have, silence."""

import struct
from random import Random
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError
from telemetry.mavlink.actions import Action, Done, Failed, Send, ended
from telemetry.mavlink.parameters.reading import ASK_AGAIN_S, TRIES, ParameterRead
from tests.telemetry.frames import attitude, heard


def _name(message: Any) -> str:
    return message.param_id if isinstance(message.param_id, str) else message.param_id.decode()


def value(name: str, number: float, kind: int = 9) -> Any:
    return heard(mavlink.MAVLink_param_value_message(name.encode(), number, kind, 1, 0))


def read(*names: str, bytewise: bool = False) -> ParameterRead:
    machine = ParameterRead(names, target=(1, 1), bytewise=bytewise)
    machine.start(0.0)
    return machine


def result(actions: list[Action]) -> dict[str, float | None]:
    end = ended(actions)
    assert isinstance(end, Done)
    assert isinstance(end.result, dict)
    return end.result


def run_out(machine: ParameterRead) -> Done | Failed | None:
    actions: list[Action] = []
    for step in range(1, TRIES + 2):
        actions += machine.on_tick(step * (ASK_AGAIN_S + 0.01))
    return ended(actions)


def test_every_name_is_asked_for_by_name() -> None:
    actions = ParameterRead(("RTL_ALT", "MIS_RESTART"), target=(1, 1), bytewise=False).start(0.0)
    asked = [action.message for action in actions if isinstance(action, Send)]
    assert [(_name(m), m.param_index, m.target_system) for m in asked] == [
        ("RTL_ALT", -1, 1),
        ("MIS_RESTART", -1, 1),
    ]


def test_values_come_in_any_order() -> None:
    machine = read("A", "B")
    assert machine.on_message(value("B", 2.5), 0.1) == []
    assert machine.on_message(value("OTHER", 9.0), 0.1) == []
    assert result(machine.on_message(value("A", 1.0), 0.2)) == {"A": 1.0, "B": 2.5}


def test_integers_stand_in_the_four_bytes_of_a_float() -> None:
    as_float = struct.unpack("<f", struct.pack("<i", -7))[0]
    assert result(read("A", bytewise=True).on_message(value("A", as_float, 6), 0.1)) == {"A": -7.0}
    assert result(read("A").on_message(value("A", -7.0, 6), 0.1)) == {"A": -7.0}
    assert result(read("A", bytewise=True).on_message(value("A", 1.5, 9), 0.1)) == {"A": 1.5}


def test_what_the_vehicle_does_not_have_is_none() -> None:
    machine = read("A", "NOT_THERE")
    machine.on_message(value("A", 1.0), 0.1)
    end = run_out(machine)
    assert isinstance(end, Done)
    assert end.result == {"A": 1.0, "NOT_THERE": None}


def test_a_vehicle_that_says_so_is_believed_at_once() -> None:
    error = mavlink.MAVLink_param_error_message(255, 190, b"A", -1, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
    assert result(read("A").on_message(heard(error), 0.1)) == {"A": None}


def test_a_name_that_cannot_be_one_is_none_without_a_question() -> None:
    assert result(ParameterRead(("X" * 17,), target=(1, 1), bytewise=False).start(0.0)) == {"X" * 17: None}


def test_a_silent_vehicle_is_an_error_and_one_that_talks_is_not() -> None:
    end = run_out(read("A"))
    assert isinstance(end, Failed)
    assert isinstance(end.error, SilentError)
    talks = read("A")
    talks.on_message(heard(attitude()), 0.1)
    assert isinstance(run_out(talks), Done)


def test_other_vehicles_answers_do_not_count() -> None:
    stranger = heard(mavlink.MAVLink_param_value_message(b"A", 5.0, 9, 1, 0), system=2)
    assert read("A").on_message(stranger, 0.1) == []


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_a_value_that_is_no_number_is_none(number: float) -> None:
    assert result(read("A").on_message(value("A", number), 0.1)) == {"A": None}


def test_over_a_link_that_loses_every_third_message_all_are_read() -> None:
    """In each direction; the names that a start is judged by, 300 times over."""
    names = ("RTL_ALT", "RTL_SPEED", "WPNAV_SPEED")
    for seed in range(300):
        random = Random(seed)
        machine = ParameterRead(names, target=(1, 1), bytewise=False)
        actions, now_s = machine.start(0.0), 0.0
        while ended(actions) is None:
            asked = [_name(action.message) for action in actions if isinstance(action, Send)]
            actions = [
                a for name in asked if random.random() > 0.51 for a in machine.on_message(value(name, 15), now_s)
            ]
            now_s += ASK_AGAIN_S
            actions += machine.on_tick(now_s) if ended(actions) is None else []
        assert result(actions) == dict.fromkeys(names, 15.0), seed
