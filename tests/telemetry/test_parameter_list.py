"""Reading the whole list: gaps, losses, a list that changes, both ways of writing integers, bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError, TransferError
from telemetry.mavlink.parameters.listing import LONGEST_S, MOST_BEGINNINGS, SILENT_S, ParameterListRead
from telemetry.topics.parameters import Parameter
from tests.telemetry.frames import packed
from tests.telemetry.lossy import VEHICLE, Faults, Run
from tests.telemetry.parameter_vehicles import ArduPilotParameters, Px4Parameters, ardupilot_table, table

FRAME_BYTES = 37
"""Of a PARAM_VALUE at most; a request has fewer."""


def read(vehicle: Any, faults: Faults = Faults(), **options: Any) -> Run:  # noqa: B008
    bytewise = isinstance(vehicle, Px4Parameters)
    return Run(ParameterListRead(target=VEHICLE, bytewise=bytewise), vehicle, faults, **options).until_end()


def expected(vehicle: ArduPilotParameters) -> tuple[Parameter, ...]:
    def kept(value: float, kind: int) -> float:
        return float(np.float32(value)) if kind == 9 else value

    return tuple(Parameter(name, kept(value, kind), kind) for name, (value, kind) in vehicle.table.items())


def sent_up(run: Run) -> list[str]:
    return [message.get_type() for _, way, message in run.log if way == "up"]


@pytest.mark.parametrize("vehicle", [ArduPilotParameters(ardupilot_table(200)), Px4Parameters(table(200))])
def test_without_losses_the_list_is_asked_for_once_and_nothing_else(vehicle: ArduPilotParameters) -> None:
    run = read(vehicle)
    assert run.result.parameters == expected(vehicle)
    assert sent_up(run) == ["PARAM_REQUEST_LIST"]


@pytest.mark.parametrize("kind", [ArduPilotParameters, Px4Parameters])
@pytest.mark.parametrize(("loss", "longest_s"), [(0.1, 30.0), (0.3, 90.0)])
def test_fifty_of_fifty_lists_are_whole_over_a_lossy_link_with_reordering(
    kind: type[ArduPilotParameters], loss: float, longest_s: float
) -> None:
    for seed in range(50):
        vehicle = kind(ardupilot_table(120) if kind is ArduPilotParameters else table(120))
        run = read(vehicle, Faults(loss=loss, reordering=0.1, duplicates=0.05, corruption=0.01), seed=seed)
        assert run.result.parameters == expected(vehicle), seed
        assert run.now_s < longest_s, seed
        assert vehicle.dropped == 0, seed


@pytest.mark.parametrize(("loss", "seconds", "share"), [(0.0, 3.0, 1.01), (0.1, 10.0, 1.3), (0.3, 40.0, 2.5)])
def test_1349_parameters_come_in_bounded_time_and_bytes(loss: float, seconds: float, share: float) -> None:
    vehicle = ArduPilotParameters(ardupilot_table(1349))
    run = read(vehicle, Faults(loss=loss, reordering=0.05), seed=3)
    assert len(run.result.parameters) == 1349
    assert run.now_s < seconds
    sent_bytes = sum(len(packed(message)) for _, _, message in run.log)
    assert sent_bytes < share * 1349 * FRAME_BYTES


def test_only_what_is_missing_is_asked_for_by_its_number() -> None:
    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        if direction == "down" and message.param_index in (3, 17) and message.param_index not in lost:
            lost.append(message.param_index)
            return True
        return False

    run = read(ArduPilotParameters(ardupilot_table(40)), lose=lose)
    asked = [m.param_index for _, way, m in run.log if way == "up" and m.get_type() == "PARAM_REQUEST_READ"]
    assert asked == [3, 17]


def test_a_list_that_grows_while_it_is_read_is_read_anew() -> None:
    class Growing(ArduPilotParameters):
        def on_message(self, message: Any, now_s: float) -> list[Any]:
            if message.get_type() == "PARAM_REQUEST_READ":
                self.table = {"FIRST": (1.0, 2), **self.table}
            return super().on_message(message, now_s)

    vehicle = Growing(ardupilot_table(40))
    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        first = direction == "down" and message.param_index == 7 and not lost
        lost.extend([7] if first else [])
        return first

    run = read(vehicle, lose=lose)
    assert run.result.parameters == expected(vehicle)
    assert run.result.by_name()["FIRST"].value == 1.0
    assert sent_up(run).count("PARAM_REQUEST_LIST") == 2


def test_late_values_of_the_list_before_a_change_do_not_begin_it_anew() -> None:
    machine = ParameterListRead(target=VEHICLE, bytewise=False)
    machine.start(0.0)
    vehicle = ArduPilotParameters(ardupilot_table(3))
    bigger = ArduPilotParameters({**vehicle.table, "NEW": (1.0, 9)})

    def hear(of: ArduPilotParameters, name: str, at_s: float) -> list[Any]:
        frame = packed(of.value(name, list(of.table).index(name)))
        return machine.on_message(mavlink.MAVLink(None).decode(bytearray(frame)), at_s)

    hear(vehicle, "P0000", 0.1)
    assert [type(a).__name__ for a in hear(bigger, "P0000", 0.2)] == ["Send"]
    assert hear(vehicle, "P0001", 0.3) == []
    for name in ("P0000", "P0001", "P0002"):
        hear(bigger, name, 0.4)
    (done,) = hear(bigger, "NEW", 0.5)
    assert [parameter.name for parameter in done.result.parameters] == list(bigger.table)


def test_a_list_that_never_stands_still_is_given_up() -> None:
    class Restless(ArduPilotParameters):
        number = 0

        def on_tick(self, now_s: float) -> list[Any]:
            if now_s > 3.0 * (self.number + 1):
                self.number += 1
                self.table[f"N{self.number}"] = (1.0, 9)
                self._listing = 0
            return [a for a in super().on_tick(now_s) if a.param_index != 5]

    run = read(Restless(ardupilot_table(10)))
    assert isinstance(run.error, TransferError)
    assert str(MOST_BEGINNINGS) in run.error.what


@pytest.mark.parametrize("number", [65535, 7])
def test_a_change_by_somebody_else_meanwhile_counts(number: int) -> None:
    """ArduPilot says it without its number, PX4 with it."""

    class Changed(ArduPilotParameters):
        def on_message(self, message: Any, now_s: float) -> list[Any]:
            if message.get_type() == "PARAM_REQUEST_READ":
                self.table["P0007"] = (8.0, 9)
                return [self.value("P0007", number), *super().on_message(message, now_s)]
            return super().on_message(message, now_s)

    lost: list[int] = []

    def lose(direction: str, message: Any, number: int) -> bool:
        first = direction == "down" and message.param_index == 9 and not lost
        lost.extend([9] if first else [])
        return first

    assert read(Changed(ardupilot_table(20)), lose=lose).result.by_name()["P0007"].value == 8.0


def test_integers_that_are_signalling_nans_as_floats_come_unchanged() -> None:
    vehicle = Px4Parameters({"A": (-8388607.0, 6), "B": (2139095041.0, 6), "C": (-1.0, 6)})

    sent: list[Any] = []
    machine = ParameterListRead(target=VEHICLE, bytewise=True)
    machine.start(0.0)
    for index, (name, (value, kind)) in enumerate(vehicle.table.items()):
        frame = bytearray(packed(mavlink.MAVLink_param_value_message(name.encode(), 1.0, kind, 3, index)))
        frame[10:14] = int(value).to_bytes(4, "little", signed=True)
        crc = mavlink.x25crc(frame[1:-2])
        crc.accumulate(bytes([mavlink.MAVLink_param_value_message.crc_extra]))
        frame[-2:] = crc.crc.to_bytes(2, "little")
        sent = machine.on_message(mavlink.MAVLink(None).decode(frame), 0.1)
    assert [parameter.value for parameter in sent[0].result.parameters] == [-8388607.0, 2139095041.0, -1.0]


def test_a_value_that_is_no_number_is_said_to_be_none() -> None:
    vehicle = ArduPilotParameters({"A": (float("nan"), 9), "B": (1.0, 9)})
    assert read(vehicle).result.by_name()["A"].value is None


def test_silence_ends_it_and_says_so() -> None:
    run = read(ArduPilotParameters({}), lose=lambda direction, message, number: True)
    assert isinstance(run.error, SilentError)
    assert run.now_s < SILENT_S + 1


def test_a_link_that_dies_on_the_way_says_how_many_did_not_come() -> None:
    run = read(ArduPilotParameters(ardupilot_table(300)), lose=lambda direction, message, number: number > 100)
    assert isinstance(run.error, TransferError)
    assert run.error.what == "200 of the vehicle's 300 parameters did not come."


def test_a_vehicle_that_claims_numbers_it_never_sends_ends_too() -> None:
    class Claims(ArduPilotParameters):
        def value(self, name: str, index: int) -> Any:
            message = super().value(name, index)
            message.param_count = 65535
            return message

    run = read(Claims(ardupilot_table(20)))
    assert isinstance(run.error, TransferError)
    assert run.now_s < LONGEST_S + 1
    assert sent_up(run).count("PARAM_REQUEST_READ") < 1000


def test_other_systems_values_do_not_count() -> None:
    machine = ParameterListRead(target=VEHICLE, bytewise=False)
    machine.start(0.0)
    frame = packed(mavlink.MAVLink_param_value_message(b"A", 1.0, 9, 1, 0), system=2)
    assert machine.on_message(mavlink.MAVLink(None).decode(bytearray(frame)), 0.1) == []
