"""What the simulated vehicle sends and how it takes commands, message by message."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.mavlink.reduce import reduce
from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS, Parameters
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.simulator_bench import HOME, Bench

ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
STREAMED = (1, 2, 24, 30, 31, 32, 33, 42, 62, 74, 87, 108, 147, 168, 193, 242, 49, 245)


def test_unasked_it_sends_no_position() -> None:
    bench = Bench()
    bench.advance(12)
    kinds = {heard.message.get_type() for heard in bench.heard}
    assert kinds == {"HEARTBEAT", "TIMESYNC", "STATUSTEXT", "HOME_POSITION", "GPS_GLOBAL_ORIGIN"}
    assert len(bench.of("HEARTBEAT")) in (12, 13)


def test_a_stream_comes_at_the_rate_asked_for_and_stops_again() -> None:
    bench = Bench()
    bench.advance(1)
    bench.stream(33, 10)
    bench.advance(5)
    assert 49 <= len(bench.of("GLOBAL_POSITION_INT")) <= 51
    assert bench.command(511, 33, -1) == ACCEPTED
    seen = len(bench.of("GLOBAL_POSITION_INT"))
    bench.advance(2)
    assert len(bench.of("GLOBAL_POSITION_INT")) == seen


def test_the_fastest_stream_comes_with_every_time_step() -> None:
    bench = Bench()
    bench.advance(1)
    bench.stream(33, 50)
    bench.advance(10)
    assert 499 <= len(bench.of("GLOBAL_POSITION_INT")) <= 501


def test_each_ground_station_has_its_own_streams() -> None:
    bench = Bench()
    bench.advance(1)
    other = wire.MAVLink_command_long_message(1, 1, 511, 0, 30, 1e5, 0, 0, 0, 0, 0)
    bench.send(other, system=254, peer="other")
    bench.stream(33, 10)
    bench.advance(1)
    assert bench.of("GLOBAL_POSITION_INT")
    assert not bench.of("ATTITUDE")


def test_old_style_stream_requests_work() -> None:
    bench = Bench()
    bench.advance(1)
    bench.send(wire.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
    bench.advance(2)
    for kind in ("GLOBAL_POSITION_INT", "ATTITUDE", "SYS_STATUS", "VFR_HUD", "MISSION_CURRENT"):
        assert 7 <= len(bench.of(kind)) <= 9
    bench.send(wire.MAVLink_request_data_stream_message(1, 1, 0, 0, 0))
    seen = len(bench.heard)
    bench.advance(2)
    assert {heard.message.get_type() for heard in bench.heard[seen:]} <= {"HEARTBEAT", "TIMESYNC"}


def test_message_intervals_can_be_read_back() -> None:
    bench = Bench()
    bench.stream(33, 4)
    bench.command(510, 33)
    assert bench.last("MESSAGE_INTERVAL").interval_us == 250_000
    assert bench.command(510, 12345) == DENIED
    assert bench.command(511, 12345, 1e6) == DENIED


@pytest.mark.parametrize(
    ("asking", "kind"), [((512, 148), "AUTOPILOT_VERSION"), ((520, 1), "AUTOPILOT_VERSION"), ((410,), "HOME_POSITION")]
)
def test_messages_come_when_asked_for(asking: tuple[int, ...], kind: str) -> None:
    bench = Bench()
    bench.advance(1)
    assert bench.command(*asking) == ACCEPTED
    assert bench.last(kind)


def test_requests_for_what_it_does_not_have_fail() -> None:
    bench = Bench()
    assert bench.command(512, 435) == FAILED
    assert bench.command(512, 242) == FAILED
    assert bench.command(31999) == UNSUPPORTED


def test_cameras_and_gimbals_are_acknowledged() -> None:
    bench = Bench()
    assert [bench.command(number, 1) for number in (203, 205, 195, 2000, 1000)] == [ACCEPTED] * 5


def test_time_is_exchanged() -> None:
    bench = Bench()
    bench.advance(2)
    answer = bench.send(wire.MAVLink_timesync_message(0, 123456))[0]
    assert (answer.tc1, answer.ts1) == (pytest.approx(2e9, abs=1e8), 123456)


def test_messages_for_others_are_left_alone() -> None:
    bench = Bench()
    bench.advance(1)
    assert bench.send(wire.MAVLink_command_long_message(7, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)) == []
    assert not bench.vehicle.autopilot.armed


def test_only_its_own_ground_station_feeds_the_failsafe() -> None:
    bench = Bench(parameters=Parameters(FS_GCS_ENABLE=1, DISARM_DELAY=0), heartbeat=False)
    bench.advance(1)
    heartbeat = wire.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    bench.send(heartbeat)
    bench.command(176, 1, 4)
    bench.command(400, 1)
    for _ in range(7):
        bench.send(heartbeat, system=200)
        bench.advance(1)
    assert "GCS Failsafe" in bench.texts()


@pytest.mark.fact("A19")
def test_parameters_are_listed_read_and_set() -> None:
    bench = Bench(heartbeat=False)
    assert bench.send(wire.MAVLink_param_request_list_message(1, 1)) == []
    bench.advance(0.2)
    listed = [heard.message for heard in bench.heard if heard.message.get_type() == "PARAM_VALUE"]
    assert [value.param_id for value in listed] == list(SPECS)
    assert [value.param_index for value in listed] == list(range(len(SPECS)))
    assert {value.param_count for value in listed} == {len(SPECS)}
    by_index = bench.send(wire.MAVLink_param_request_read_message(1, 1, b"", list(SPECS).index("RTL_ALT")))[0]
    assert (by_index.param_id, by_index.param_value, by_index.param_type) == ("RTL_ALT", 1500.0, 6)
    by_name = bench.send(wire.MAVLink_param_request_read_message(1, 1, b"RTL_ALT", -1))[0]
    assert (by_name.param_value, by_name.param_index) == (1500.0, 65535)
    assert bench.send(wire.MAVLink_param_set_message(1, 1, b"RTL_ALT", 1e9, 9))[0].param_value == 300_000
    assert bench.send(wire.MAVLink_param_set_message(1, 1, b"NO_SUCH", 1.0, 9)) == []
    assert bench.send(wire.MAVLink_param_request_read_message(1, 1, b"", 9999)) == []


def test_a_change_is_heard_by_every_ground_station_and_a_list_by_the_one_that_asked() -> None:
    bench = Bench(heartbeat=False)
    bench.endpoint.connect("other")
    request = bench.endpoint.on_message
    change = wire.MAVLink_param_set_message(1, 1, b"RTL_ALT", 2000.0, 6)
    assert {peer for peer, _ in request(change, "gcs", 0.0)} == {"gcs", "other"}
    assert request(wire.MAVLink_param_request_list_message(1, 1), "other", 0.1) == []
    values = [(peer, message) for peer, message in bench.endpoint.on_slice(0.2) if message.get_type() == "PARAM_VALUE"]
    assert {peer for peer, _ in values} == {"other"}
    bench.endpoint.disconnect("other")
    assert not any(message.get_type() == "PARAM_VALUE" for _, message in bench.endpoint.on_slice(0.4))


def test_hedgehops_reducer_understands_all_of_it() -> None:
    bench = Bench(gnss="rtk", seed=5, parameters=Parameters(SIM_WIND_SPD=4, SIM_WIND_DIR=90))
    bench.advance(1)
    for message_id in STREAMED:
        bench.stream(message_id, 5)
    bench.command(176, 1, 4)
    bench.command(400, 1)
    bench.command(22, 0, 0, 0, 0, 0, 0, 6.0)
    bench.advance(12)
    state: VehicleState | None = None
    for heard in bench.heard:
        state = reduce(state, heard.message, t_mono_s=heard.t_s, t_utc_s=1e9 + heard.t_s)
    assert state is not None
    assert (state.autopilot, state.mode, state.armed, state.landed) == ("ardupilot", "GUIDED", True, "in_air")
    assert state.alt_rel_home_m == pytest.approx(6.0, abs=0.3)
    assert state.alt_amsl_m == pytest.approx(HOME.alt_amsl_m + 6, abs=0.4)
    assert state.lat_deg == pytest.approx(HOME.lat_deg, abs=1e-5)
    assert (state.gnss_fix, state.satellites) == ("rtk_fixed", 24)
    assert state.battery_share is not None
    assert 0.9 < state.battery_share < 1
    assert state.estimator_ok
    assert state.wind_speed_m_s == pytest.approx(4.0)
    assert state.wind_from_rad == pytest.approx(math.pi / 2)
    assert state.home_alt_amsl_m == pytest.approx(HOME.alt_amsl_m, abs=0.2)


@pytest.fixture(scope="module")
def thrown_at() -> Bench:
    """One flying vehicle for all that is thrown at it: what one message spoils, a later one shows."""
    bench = Bench()
    bench.advance(1)
    for message_id in STREAMED:
        bench.stream(message_id, 20)
    bench.command(176, 1, 4)
    bench.command(400, 1)
    bench.command(22, 0, 0, 0, 0, 0, 0, 20.0)
    bench.advance(15)
    return bench


numbers = st.floats(width=32) | st.sampled_from([0.0, 1.0, 3.0, 4.0, 21196.0])


@settings(deadline=None, max_examples=150)
@given(
    st.sampled_from([17, 20, 21, 22, 115, 176, 178, 192, 193, 224, 300, 400, 401, 510, 511, 512, 179])
    | st.integers(0, 65535),
    st.tuples(*[numbers] * 7),
    st.booleans(),
    st.integers(0, 255),
)
def test_no_command_upsets_it(
    thrown_at: Bench, command: int, params: tuple[float, ...], as_int: bool, frame: int
) -> None:
    bench = thrown_at
    place = [int(value * 1e7) if math.isfinite(value) and abs(value) < 200 else 0 for value in params[4:6]]
    rest: tuple[Any, ...] = (*params[:4], *place, params[6])
    order: Any = wire.MAVLink_command_long_message(1, 1, command, 0, *params)
    if as_int:
        order = wire.MAVLink_command_int_message(1, 1, frame, command, 0, 0, *rest)
    answers = [answer for answer in bench.send(order) if answer.get_type() == "COMMAND_ACK"]
    assert [answer.command for answer in answers] == [command]
    bench.advance(0.04)
    assert all(math.isfinite(value) for value in bench.vehicle.truth.p_neu)


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 65535), st.integers(0, 12), st.tuples(*[st.floats(width=32)] * 9))
def test_no_target_upsets_it(thrown_at: Bench, mask: int, frame: int, numbers: tuple[float, ...]) -> None:
    bench = thrown_at
    local: tuple[Any, ...] = (*numbers, 0.0, math.nan)
    bench.send(wire.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *local))
    above: tuple[Any, ...] = (0, 0, *numbers[:8], math.nan)
    bench.send(wire.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, mask, *above))
    bench.advance(0.04)
    assert all(math.isfinite(value) for value in (*bench.vehicle.truth.p_neu, bench.vehicle.truth.heading_rad))
