"""Heartbeats, pings, messages on request and at a rate, commands: raw, against both simulated autopilots."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from tests.telemetry.protocols.station import MAKES, Station

ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
MESSAGE, INTERVAL, INTERVAL_OF, CAPABILITIES = 512, 511, 510, 520


@pytest.fixture(params=MAKES)
def station(request: pytest.FixtureRequest) -> Station:
    return Station(request.param)


def rate_hz(station: Station, kind: str, for_s: float = 4.0) -> float:
    before = len(station.bench.of(kind))
    station.bench.advance(for_s)
    return (len(station.bench.of(kind)) - before) / for_s


def test_its_heart_beats_once_a_second(station: Station) -> None:
    assert rate_hz(station, "HEARTBEAT", 10.0) == pytest.approx(1.0, abs=0.1)
    beat = station.bench.last("HEARTBEAT")
    assert beat.autopilot == {"ardupilot": 3, "px4": 12}[station.make]
    assert (beat.type, beat.mavlink_version) == (wire.MAV_TYPE_QUADROTOR, 3)


@pytest.mark.fact("A47")
@pytest.mark.parametrize("seq", [0, 1, 2**32 - 1])
def test_a_ping_to_everybody_comes_back_to_its_sender(station: Station, seq: int) -> None:
    (pong,) = station.answers(wire.MAVLink_ping_message(123_456_789, seq, 0, 0), system=77, component=3)
    assert (pong.time_usec, pong.seq) == (123_456_789, seq)
    assert (pong.target_system, pong.target_component) == (77, 3)


def test_the_answer_to_a_ping_is_not_answered(station: Station) -> None:
    assert station.answers(wire.MAVLink_ping_message(5, 9, 1, 1)) == []


@pytest.mark.parametrize("command", [MESSAGE, CAPABILITIES])
def test_its_version_comes_when_it_is_asked_for(station: Station, command: int) -> None:
    assert not station.bench.of("AUTOPILOT_VERSION")
    first = wire.MAVLINK_MSG_ID_AUTOPILOT_VERSION if command == MESSAGE else 1
    nan = math.nan
    ack, version = station.answers(wire.MAVLink_command_long_message(1, 1, command, 0, first, *[nan] * 6))
    assert (ack.get_type(), ack.command, ack.result) == ("COMMAND_ACK", command, ACCEPTED)
    assert version.get_type() == "AUTOPILOT_VERSION"
    assert version.capabilities & wire.MAV_PROTOCOL_CAPABILITY_MAVLINK2


def test_a_message_that_it_does_not_have_is_refused(station: Station) -> None:
    answers = station.answers(wire.MAVLink_command_long_message(1, 1, MESSAGE, 0, 9999, *[0] * 6))
    assert [(one.get_type(), one.result == ACCEPTED) for one in answers] == [("COMMAND_ACK", False)]


@pytest.mark.parametrize("as_int", [False, True])
def test_an_unknown_command_is_unsupported_and_says_to_whom(station: Station, as_int: bool) -> None:
    message = wire.MAVLink_command_long_message(1, 1, 65_000, 0, *[0] * 7)
    if as_int:
        message = wire.MAVLink_command_int_message(1, 1, 0, 65_000, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    (ack,) = station.answers(message, system=77, component=3)
    assert (ack.command, ack.result) == (65_000, UNSUPPORTED)
    assert (ack.target_system, ack.target_component) == (77, 3)


def test_a_command_sent_twice_is_answered_twice(station: Station) -> None:
    """The first answer may have been lost."""
    home = wire.MAVLINK_MSG_ID_HOME_POSITION
    asked = wire.MAVLink_command_long_message(1, 1, INTERVAL, 0, home, 5e6, *[0] * 5)
    assert [[one.result for one in station.answers(asked)] for _ in range(2)] == [[ACCEPTED]] * 2


def test_another_vehicles_commands_are_not_answered(station: Station) -> None:
    assert station.answers(wire.MAVLink_command_long_message(9, 1, MESSAGE, 0, 148, *[0] * 6)) == []


@pytest.mark.parametrize("hz", [1.0, 5.0, 10.0])
@pytest.mark.parametrize("message_id", [wire.MAVLINK_MSG_ID_ATTITUDE, wire.MAVLINK_MSG_ID_BATTERY_STATUS])
def test_messages_come_at_the_rate_that_was_asked_for(station: Station, message_id: int, hz: float) -> None:
    assert station.bench.command(INTERVAL, message_id, 1e6 / hz) == ACCEPTED
    kind = wire.mavlink_map[message_id].msgname
    assert rate_hz(station, kind) == pytest.approx(hz, rel=0.1, abs=0.3)
    station.answers(wire.MAVLink_command_long_message(1, 1, INTERVAL_OF, 0, message_id, *[0] * 6))
    assert station.bench.last("MESSAGE_INTERVAL").interval_us == pytest.approx(1e6 / hz)


def test_a_message_that_is_stopped_comes_no_more(station: Station) -> None:
    station.bench.command(INTERVAL, wire.MAVLINK_MSG_ID_ATTITUDE, 1e5)
    station.bench.command(INTERVAL, wire.MAVLINK_MSG_ID_ATTITUDE, -1)
    station.bench.advance(0.1)
    assert rate_hz(station, "ATTITUDE") == 0


def test_px4_tells_unasked_what_a_station_needs() -> None:
    station = Station("px4")
    least_hz = {
        "BATTERY_STATUS": 0.5, "SYS_STATUS": 1, "EXTENDED_SYS_STATE": 1, "GPS_RAW_INT": 1, "GLOBAL_POSITION_INT": 5,
        "ALTITUDE": 1, "ATTITUDE": 10, "ATTITUDE_QUATERNION": 10, "ESTIMATOR_STATUS": 0.5, "HOME_POSITION": 0.5,
        "LOCAL_POSITION_NED": 10, "VFR_HUD": 4,
    }  # fmt: skip
    before = {kind: len(station.bench.of(kind)) for kind in least_hz}
    station.bench.advance(10.0)
    found_hz = {kind: (len(station.bench.of(kind)) - before[kind]) / 10 for kind in least_hz}
    assert all(found_hz[kind] >= least - 0.1 for kind, least in least_hz.items()), found_hz


def test_its_clock_is_told_to_whoever_asks(station: Station) -> None:
    (answer,) = station.bench.send(wire.MAVLink_timesync_message(0, 42))
    assert (answer.ts1, answer.tc1) == (42, int(station.bench.now_s * 1e9))


def test_arming_twice_is_no_error(station: Station) -> None:
    if station.make == "ardupilot":
        assert station.bench.command(176, 1, 4) == ACCEPTED
    assert [station.bench.command(400, 1), station.bench.command(400, 1)] == [ACCEPTED, ACCEPTED]
    assert [station.bench.command(400, 0), station.bench.command(400, 0)] == [ACCEPTED, ACCEPTED]
    station.bench.advance(1.2)
    assert not station.bench.last("HEARTBEAT").base_mode & wire.MAV_MODE_FLAG_SAFETY_ARMED
