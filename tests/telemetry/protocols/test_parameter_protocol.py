"""Parameters, raw on the wire, against both simulated autopilots: by name, by number, as a list, and what is wrong."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from tests.telemetry.protocols.station import MAKES, Station
from tests.telemetry.simulator_bench import Bench

INT32, FLOAT = wire.MAV_PARAM_TYPE_INT32, wire.MAV_PARAM_TYPE_REAL32
WHOLE = {"ardupilot": ("RTL_ALT", 1500, 4200), "px4": ("RTL_CONE_ANG", 45, 60)}
FRACTION = {"ardupilot": ("WPNAV_JERK", 2.5), "px4": ("RTL_RETURN_ALT", 42.5)}
"""Name, default and another value."""
HASH = "_HASH_CHECK"
UNNUMBERED = 65535


@pytest.fixture(params=MAKES)
def station(request: pytest.FixtureRequest) -> Station:
    return Station(request.param)


def read(station: Station, name: bytes | str, index: int = -1) -> list[Any]:
    name = name if isinstance(name, bytes) else name.encode()
    return station.answers(wire.MAVLink_param_request_read_message(1, 1, name, index), for_s=0.1)


def write(station: Station, name: str, value: float, kind: int, **sender: int) -> list[Any]:
    message = wire.MAVLink_param_set_message(1, 1, name.encode(), value, kind)
    return station.answers(message, for_s=0.1, **sender)


def on_wire(make: str, whole: int) -> float:
    """ArduPilot sends whole numbers as floats, PX4 their bytes."""
    return struct.unpack("<f", struct.pack("<i", whole))[0] if make == "px4" else float(whole)


def value_of(make: str, answer: Any) -> float:
    if make == "px4" and answer.param_type == INT32:
        return struct.unpack("<i", struct.pack("<f", answer.param_value))[0]
    return answer.param_value


def listed(station: Station) -> list[Any]:
    station.forget()
    station.say(wire.MAVLink_param_request_list_message(1, 1))
    found = []
    while (value := station.hear("PARAM_VALUE", limit_s=1.0)) is not None:
        found.append(value)
    return found


def test_a_whole_number_is_read_written_and_read_again(station: Station) -> None:
    name, default, other = WHOLE[station.make]
    seen = []
    for value in (None, other, default):
        if value is not None:
            echoed = write(station, name, on_wire(station.make, value), INT32)
            assert [(one.param_id, value_of(station.make, one)) for one in echoed] == [(name, value)]
        (answer,) = read(station, name)
        assert (answer.param_id, answer.param_type) == (name, INT32)
        seen.append(value_of(station.make, answer))
    assert seen == [default, other, default]


def test_a_fraction_is_kept_as_it_is(station: Station) -> None:
    name, value = FRACTION[station.make]
    write(station, name, value, FLOAT)
    (answer,) = read(station, name)
    assert (answer.param_type, answer.param_value) == (FLOAT, value)


def test_the_list_has_every_number_once_and_then_ends(station: Station) -> None:
    values = [one for one in listed(station) if one.param_id != HASH]
    count = values[0].param_count
    assert sorted(one.param_index for one in values) == list(range(count))
    assert len({one.param_id for one in values}) == count
    assert {one.param_count for one in values} == {count}
    station.bench.advance(1.0)
    assert station.hear("PARAM_VALUE", limit_s=0.5) is None


def test_px4s_list_begins_with_its_hash_which_counts_for_nothing() -> None:
    values = listed(Station("px4"))
    assert [one.param_id for one in values].count(HASH) == 1
    assert (values[0].param_id, values[0].param_index) == (HASH, UNNUMBERED)
    assert values[0].param_count == len(values) - 1


def test_px4s_hash_changes_with_a_value_and_comes_back_with_it() -> None:
    station = Station("px4")
    hashes = []
    for value in (45, 60, 45):
        write(station, "RTL_CONE_ANG", on_wire("px4", value), INT32)
        hashes.append(struct.pack("<f", read(station, HASH)[0].param_value))
    assert hashes[0] == hashes[2] != hashes[1]


def test_by_its_number_each_is_what_the_list_said(station: Station) -> None:
    values = {one.param_index: one for one in listed(station) if one.param_id != HASH}
    for index in (0, len(values) // 2, len(values) - 1):
        (answer,) = read(station, b"", index)
        said = values[index]
        assert (answer.param_id, answer.param_index, answer.param_type) == (said.param_id, index, said.param_type)
        assert struct.pack("<f", answer.param_value) == struct.pack("<f", said.param_value)


@pytest.mark.parametrize("index", [5000, 32767])
def test_a_number_beyond_the_last_is_not_answered(station: Station, index: int) -> None:
    assert read(station, b"", index) == []


def test_a_number_goes_before_a_name(station: Station) -> None:
    (answer,) = read(station, WHOLE[station.make][0], 0)
    assert answer.param_index == 0


@pytest.mark.parametrize(
    "name", [b"", b"NO_SUCH", b"A_NAME_OF_16_LET", b"rtl_alt", b"RTL_ALT\x00X", b"\xff\xfe\x00", b"RTL_AL"]
)
def test_unusual_names_are_not_answered_and_change_nothing(station: Station, name: bytes) -> None:
    before = {key: station.bench.vehicle.parameters[key] for key in station.bench.vehicle.parameters}
    known = name.split(b"\x00")[0] == b"RTL_ALT" and station.make == "ardupilot"
    assert len(read(station, name)) == known
    assert known or station.answers(wire.MAVLink_param_set_message(1, 1, name, 7.0, FLOAT), for_s=0.1) == []
    assert {key: station.bench.vehicle.parameters[key] for key in station.bench.vehicle.parameters} == before


def test_a_name_of_sixteen_letters_needs_no_end() -> None:
    """The longest that there are: on the wire no zero follows them."""
    station = Station("ardupilot")
    longest = max(station.bench.vehicle.parameters, key=len)
    (answer,) = read(station, longest.encode().ljust(16, b"\x00"))
    assert answer.param_id == longest


def test_a_value_of_another_type_is_cast_by_ardupilot_and_refused_by_px4(station: Station) -> None:
    name, default, other = WHOLE[station.make]
    write(station, name, float(other), FLOAT)
    (answer,) = read(station, name)
    assert value_of(station.make, answer) == (other if station.make == "ardupilot" else default)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_changes_nothing_and_ardupilot_says_nothing(value: float) -> None:
    station = Station("ardupilot")
    name, _ = FRACTION["ardupilot"]
    before = station.bench.vehicle.parameters[name]
    assert write(station, name, value, FLOAT) == []
    assert station.bench.vehicle.parameters[name] == before


def test_a_value_beyond_its_limits_is_echoed_as_it_is_kept(station: Station) -> None:
    name, _, _ = WHOLE[station.make]
    (echoed,) = write(station, name, on_wire(station.make, 2_000_000_000), INT32)
    assert value_of(station.make, echoed) == station.bench.vehicle.parameters[name] < 2_000_000_000


def test_another_station_hears_of_a_change(station: Station) -> None:
    name, _, other = WHOLE[station.make]
    heard = write(station, name, on_wire(station.make, other), INT32, system=77)
    assert [value_of(station.make, one) for one in heard] == [other]


def test_another_vehicles_parameters_are_not_its_own(station: Station) -> None:
    name, default, other = WHOLE[station.make]
    message = wire.MAVLink_param_set_message(9, 1, name.encode(), on_wire(station.make, other), INT32)
    assert station.answers(message) == []
    assert station.bench.vehicle.parameters[name] == default
    assert station.answers(wire.MAVLink_param_request_list_message(9, 1)) == []


@pytest.mark.parametrize("make", MAKES)
def test_all_are_read_over_a_link_that_loses_a_third(make: str) -> None:
    """The list first, then what is missing by its number."""
    station = Station(make, loss=0.3, seed=5)
    found: dict[int, str] = {}
    count = len(list(station.bench.vehicle.parameters))
    while not found:
        found = {one.param_index: one.param_id for one in listed(station) if one.param_id != HASH}
    assert len(found) < count
    for index in set(range(count)) - set(found):
        asked = wire.MAVLink_param_request_read_message(1, 1, b"", index)
        found[index] = station.ask(
            asked, "PARAM_VALUE", tell=lambda one, index=index: one.param_index == index
        ).param_id
    assert [found[index] for index in range(count)] == list(station.bench.vehicle.parameters)


@pytest.mark.parametrize("make", MAKES)
def test_a_change_arrives_over_a_link_that_loses_half(make: str) -> None:
    station = Station(make, loss=0.5, seed=2)
    name, default, other = WHOLE[make]
    for value in (other, default) * 3:
        message = wire.MAVLink_param_set_message(1, 1, name.encode(), on_wire(make, value), INT32)
        station.ask(
            message, "PARAM_VALUE", tell=lambda one, value=value: (one.param_id, value_of(make, one)) == (name, value)
        )
        assert station.bench.vehicle.parameters[name] == value


@pytest.mark.parametrize("make", MAKES)
def test_newer_firmware_says_that_it_has_no_such_parameter(make: str) -> None:
    bench = Bench(make=make, parameter_errors=True)
    asked = wire.MAVLink_param_request_read_message(1, 1, b"NOT_THERE", -1)
    beyond = wire.MAVLink_param_request_read_message(1, 1, b"", len(bench.vehicle.parameters))
    written = wire.MAVLink_param_set_message(1, 1, b"NOT_THERE", 1.0, FLOAT)
    for message, index in ((asked, -1), (beyond, len(bench.vehicle.parameters)), (written, -1)):
        (answer,) = bench.send(message, system=254, component=191)
        assert answer.get_type() == "PARAM_ERROR"
        assert (answer.param_index, answer.error) == (index, wire.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        assert (answer.target_system, answer.target_component) == (254, 191)
    (value,) = bench.send(wire.MAVLink_param_request_read_message(1, 1, WHOLE[make][0].encode(), -1))
    assert value.get_type() == "PARAM_VALUE"
