"""Writing with read-back: taken, rounded, limited, refused in words or in silence, armed or gone meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError
from telemetry.mavlink.parameters.writing import ParameterWrite
from telemetry.topics.parameters import ParameterChange, ParameterWritten
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.frames import attitude
from tests.telemetry.lossy import VEHICLE, Faults, Run
from tests.telemetry.parameter_vehicles import ArduPilotParameters, Px4Parameters, table

ALIVE = attitude()


class Alive(ArduPilotParameters):
    """Says something, whatever it is asked."""

    def on_tick(self, now_s: float) -> list[Any]:
        return [ALIVE, *super().on_tick(now_s)]


def write(vehicle: Any, **changes: float) -> tuple[ParameterWritten, ...]:
    return run(vehicle, changes).result


def run(
    vehicle: Any,
    changes: dict[str, float],
    faults: Faults = Faults(),  # noqa: B008
    *,
    lose: Callable[[str, Any, int], bool] = lambda direction, message, number: False,
    seed: int = 0,
) -> Run:
    machine = ParameterWrite(
        tuple(ParameterChange(name, value) for name, value in changes.items()),
        target=VEHICLE,
        bytewise=isinstance(vehicle, Px4Parameters),
    )
    return Run(machine, vehicle, faults, seed, lose).until_end()


def sets(made: Run) -> list[str]:
    return [m.param_id for _, way, m in made.log if way == "up" and m.get_type() == "PARAM_SET"]


def test_what_is_written_is_echoed_and_read_again() -> None:
    vehicle = ArduPilotParameters({"RTL_ALT": (1500.0, 6), "WP_SPD": (5.0, 9)})
    made = run(vehicle, {"RTL_ALT": 1900.0, "WP_SPD": 3.3})
    first, second = made.result
    assert first == ParameterWritten("RTL_ALT", 1900.0, 1500.0, 1900.0, "set")
    assert (second.outcome, second.before) == ("set", 5.0)
    assert vehicle.table["RTL_ALT"] == (1900.0, 6)
    assert sets(made) == ["RTL_ALT", "WP_SPD"]
    up = [m.get_type() for _, way, m in made.log if way == "up"]
    assert up == 2 * ["PARAM_REQUEST_READ", "PARAM_SET", "PARAM_REQUEST_READ"]
    kinds = [m.param_type for _, way, m in made.log if way == "up" and m.get_type() == "PARAM_SET"]
    assert kinds == [6, 9]


def test_what_is_so_already_is_not_sent() -> None:
    made = run(ArduPilotParameters({"A": (0.1, 9)}), {"A": 0.1})
    assert [written.outcome for written in made.result] == ["same"]
    assert made.result[0].took
    assert sets(made) == []


@pytest.mark.parametrize(("loss", "reordering"), [(0.1, 0.1), (0.3, 0.2)])
@pytest.mark.parametrize("kind", [ArduPilotParameters, Px4Parameters])
def test_fifty_of_fifty_writings_are_whole_over_a_lossy_link(
    kind: type[ArduPilotParameters], loss: float, reordering: float
) -> None:
    faults = Faults(loss=loss, reordering=reordering, duplicates=0.05, corruption=0.01, late_s=0.4)
    for seed in range(50):
        held = {name: (1.0, number) for name, (_, number) in table(16).items()}
        vehicle = kind(held)
        asked = {name: float(10 + index) for index, name in enumerate(held)}
        made = run(vehicle, asked, faults, seed=seed)
        assert [written.outcome for written in made.result] == 16 * ["set"], seed
        assert {name: value for name, (value, _) in vehicle.table.items()} == asked, seed
        assert made.now_s < 60.0, seed


class Keeps(ArduPilotParameters):
    """Takes nothing, and echoes what it holds."""

    def on_set(self, message: Any) -> list[Any]:
        return [self.value(message.param_id, 65535)]


@pytest.mark.parametrize("round_trip_s", [0.3, 1.0, 1.6, 2.0, 4.0])
def test_late_answers_of_a_slow_link_are_not_what_the_vehicle_holds_now(round_trip_s: float) -> None:
    slow = Faults(latency_s=round_trip_s / 2)
    vehicle = ArduPilotParameters({"A": (1.0, 9), "B": (5.0, 6)})
    made = run(vehicle, {"A": 2.0, "B": 6.4}, slow)
    assert [(w.outcome, w.before, w.after) for w in made.result] == [("set", 1.0, 2.0), ("refused", 5.0, 5.0)]
    assert vehicle.table == {"A": (2.0, 9), "B": (5.0, 6)}
    (kept,) = run(Keeps({"A": (1.0, 9)}), {"A": 2.0}, slow).result
    assert (kept.outcome, kept.after) == ("kept", 1.0)


@pytest.mark.fact("P26")
def test_integers_of_px4_go_bytewise() -> None:
    vehicle = Px4Parameters({"NAV_DLL_ACT": (0.0, 6), "BIG": (0.0, 6), "NEG": (0.0, 6)})
    assert all(w.outcome == "set" for w in write(vehicle, NAV_DLL_ACT=2.0, BIG=2_000_000_001.0, NEG=-1.0))
    assert [value for value, _ in vehicle.table.values()] == [2.0, 2_000_000_001.0, -1.0]


def test_an_integer_that_no_float_carries_is_not_sent() -> None:
    made = run(Px4Parameters({"A": (0.0, 6)}), {"A": -8388607.0})
    assert made.result[0].outcome == "refused"
    assert "No float carries" in made.result[0].words
    assert sets(made) == []


@pytest.mark.parametrize(
    ("kind", "value", "words"),
    [
        (2, 1.5, "whole numbers only"),
        (2, 128.0, "-128 to 127"),
        (3, -1.0, "0 to 65535"),
        (9, float("nan"), "no finite number"),
        (6, float("inf"), "no finite number"),
        (9, 1e39, "single precision"),
    ],
)
def test_what_the_type_cannot_hold_is_not_sent(kind: int, value: float, words: str) -> None:
    made = run(ArduPilotParameters({"A": (1.0, kind)}), {"A": value})
    (written,) = made.result
    assert (written.outcome, written.after) == ("refused", 1.0)
    assert words in written.words
    assert "Nothing was sent" in written.words
    assert sets(made) == []


def test_a_value_that_is_limited_is_said() -> None:
    class Limits(ArduPilotParameters):
        def on_set(self, message: Any) -> list[Any]:
            message.param_value = min(message.param_value, 100.0)
            return super().on_set(message)

    (written,) = write(Limits({"A": (1.0, 9)}), A=500.0)
    assert (written.outcome, written.after, written.took) == ("adjusted", 100.0, False)
    assert "rounds or limits" in written.words


def test_an_echo_is_not_believed_where_the_read_back_says_otherwise() -> None:
    class Lies(ArduPilotParameters):
        def on_set(self, message: Any) -> list[Any]:
            kind = self.table["A"][1]
            return [mavlink.MAVLink_param_value_message(b"A", message.param_value, kind, 1, 65535)]

    (written,) = write(Lies({"A": (1.0, 9)}), A=5.0)
    assert (written.outcome, written.after) == ("kept", 1.0)


def test_a_late_answer_with_the_old_value_does_not_pass_for_a_refusal() -> None:
    class Late(ArduPilotParameters):
        sets = 0

        def on_set(self, message: Any) -> list[Any]:
            old = self.value("A", 65535)
            return [old, *super().on_set(message), old]

    (written,) = write(Late({"A": (1.0, 9)}), A=5.0)
    assert (written.outcome, written.after) == ("set", 5.0)


def test_a_refusal_in_silence_is_found_by_reading_and_the_vehicles_words_are_told() -> None:
    class Denies(ArduPilotParameters):
        def on_set(self, message: Any) -> list[Any]:
            return [mavlink.MAVLink_statustext_message(4, b"Param write denied (A)", 0, 0)]

    first, second = write(Denies({"A": (1.0, 9), "B": (5.0, 9)}), A=5.0, B=5.0)
    assert (first.outcome, first.after) == ("kept", 1.0)
    assert 'It says: "Param write denied (A)"' in first.words
    assert second.outcome == "same"


@pytest.mark.parametrize(("code", "words"), [(2, "out of its range"), (5, "lets nobody"), (9, "parameter error 9")])
def test_a_refusal_in_words(code: int, words: str) -> None:
    class Refuses(ArduPilotParameters):
        def on_set(self, message: Any) -> list[Any]:
            return [mavlink.MAVLink_param_error_message(255, 190, b"A", -1, code)]

    (written,) = write(Refuses({"A": (1.0, 9)}), A=5.0)
    assert (written.outcome, written.before, written.after) == ("refused", 1.0, 1.0)
    assert words in written.words


@pytest.mark.parametrize("name", ["", "A" * 17, "RTL ALT", "H\u00d6HE"])
def test_a_name_that_no_vehicle_has_is_not_cut_to_another(name: str) -> None:
    made = run(ArduPilotParameters({"A" * 16: (1.0, 9)}), {name: 5.0})
    assert made.result[0].outcome == "refused"
    assert "letters, digits and _" in made.result[0].words
    assert made.log == []


def test_a_name_that_the_vehicle_does_not_have() -> None:
    (written,) = write(Px4Parameters({"A": (1.0, 9)}), NO_SUCH=5.0)
    assert written.outcome == "refused"
    assert "no parameter of this name" in written.words
    silent, there = write(Alive({"A": (1.0, 9)}), NO_SUCH=5.0, A=2.0)
    assert silent.outcome == "refused"
    assert "does not answer to this name" in silent.words
    assert there.outcome == "set"


def test_a_silent_vehicle_is_an_error_before_anything_was_sent() -> None:
    made = run(ArduPilotParameters({"A": (1.0, 9)}), {"A": 5.0}, lose=lambda *_: True)
    assert isinstance(made.error, SilentError)
    assert "nothing was written" in made.error.what


@pytest.mark.parametrize(("at", "outcomes"), [(2, ["unknown", "not sent"]), (6, ["set", "not sent"])])
def test_a_link_that_dies_leaves_what_was_sent_unknown_and_the_rest_unsent(at: int, outcomes: list[str]) -> None:
    vehicle = ArduPilotParameters({"A": (1.0, 9), "B": (1.0, 9)})
    made = run(vehicle, {"A": 5.0, "B": 5.0}, lose=lambda direction, message, number: number >= at)
    assert [written.outcome for written in made.result] == outcomes
    assert not any(written.took for written in made.result[at // 6 :])
    assert made.now_s < 30.0


@pytest.mark.parametrize("even_armed", [False, True])
def test_a_vehicle_that_is_armed_meanwhile_is_written_no_further(even_armed: bool) -> None:
    vehicle = ArduPilotParameters({"A": (1.0, 9), "B": (1.0, 9)})
    changes = (ParameterChange("A", 5.0), ParameterChange("B", 5.0))
    machine = ParameterWrite(changes, target=VEHICLE, bytewise=False, even_armed=even_armed)
    armed = replace(VehicleState(system_id=1, component_id=1, autopilot="ardupilot", vehicle_type=2), armed=True)

    class Arms(Run):
        def _do(self, actions: list[Any]) -> None:
            super()._do(actions)
            if any(getattr(getattr(a, "message", None), "get_type", str)() == "PARAM_SET" for a in actions):
                machine.on_state(armed, self.now_s)

    made = Arms(machine, vehicle).until_end()
    assert made.result[0].outcome == "set"
    assert made.result[1].outcome == ("set" if even_armed else "not sent")
    if not even_armed:
        assert "Land, disarm it" in made.result[1].words
        assert vehicle.table["B"][0] == 1.0
