"""The vehicle-state reducer, on messages made by hand and on the logs of real vehicles."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.reduce import is_vehicle_heartbeat, reduce
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.frames import heard, heartbeat
from tests.telemetry.tlogs import tlog_messages

NAN = math.nan


def rc_channels(rssi: int) -> Any:
    make: Any = mavlink.MAVLink_rc_channels_message
    return make(0, 8, *[0] * 18, rssi)


def version(number: int) -> Any:
    zeros = [0] * 8
    return mavlink.MAVLink_autopilot_version_message(0, number, 0, 0, 0, zeros, zeros, zeros, 0, 0, 0)


def after(*messages: Any, state: VehicleState | None = None) -> VehicleState | None:
    for message in messages:
        state = reduce(state, heard(message), t_mono_s=5.0, t_utc_s=1.7e9)
    return state


def known(*messages: Any) -> VehicleState:
    state = after(heartbeat(), *messages)
    assert state is not None
    return state


@pytest.mark.parametrize(
    ("autopilot", "kind", "custom_mode", "mode"),
    [
        (3, 2, 3, "AUTO"),
        (3, 2, 4, "GUIDED"),
        (3, 2, 6, "RTL"),
        (3, 2, 21, "SMART_RTL"),
        (3, 2, 77, "MODE 77"),
        (3, 1, 10, "AUTO"),
        (3, 10, 4, "HOLD"),
        (12, 2, 4 << 16 | 4 << 24, "MISSION"),
        (12, 2, 4 << 16 | 3 << 24, "HOLD"),
        (12, 2, 4 << 16 | 5 << 24, "RTL"),
        (12, 2, 3 << 16, "POSCTL"),
        (12, 2, 0, "MODE 0"),
        (4, 2, 3, "MODE 3"),
    ],
)
def test_the_mode_has_the_autopilots_own_name(autopilot: int, kind: int, custom_mode: int, mode: str) -> None:
    state = after(heartbeat(autopilot, kind, custom_mode))
    assert state is not None
    assert state.mode == mode


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        mavlink.MAVLink_heartbeat_message(26, 8, 0, 0, 4, 3),
        mavlink.MAVLink_attitude_message(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    ],
)
def test_only_an_autopilots_heartbeat_begins_a_vehicle(message: Any) -> None:
    assert after(message) is None


def test_a_ground_station_that_shares_the_ids_changes_nothing() -> None:
    armed = known(heartbeat(base_mode=129))
    assert after(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), state=armed) is armed


def test_other_systems_and_other_components_change_nothing() -> None:
    state = known()
    attitude = mavlink.MAVLink_attitude_message(0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    for system, component in ((2, 1), (255, 190), (1, 100)):
        assert reduce(state, heard(attitude, system=system, component=component), t_mono_s=6, t_utc_s=6) is state


def test_arming_and_a_failsafe_are_seen() -> None:
    assert known().armed is False
    state = known(heartbeat(base_mode=129, custom_mode=6, status=5))
    assert (state.armed, state.critical, state.mode, state.heartbeat_t_mono_s) == (True, True, "RTL", 5.0)


def test_a_position_has_all_its_parts_and_its_time() -> None:
    state = known(
        mavlink.MAVLink_global_position_int_message(9, -369100123, 1756000456, 853150, 50010, 300, -400, -120, 9)
    )
    assert (state.lat_deg, state.lon_deg) == (-36.9100123, 175.6000456)
    assert (state.alt_amsl_m, state.alt_rel_home_m) == (853.15, 50.01)
    assert (state.v_north_m_s, state.v_east_m_s, state.v_down_m_s) == (3.0, -4.0, -1.2)
    assert (state.ground_speed_m_s, state.climb_m_s) == (5.0, 1.2)
    assert (state.position_t_mono_s, state.t_utc_s) == (5.0, 1.7e9)


@pytest.mark.parametrize(("lat", "lon"), [(0, 0), (2147483647, 2147483647), (950000000, 10), (10, -1900000000)])
def test_a_place_that_is_none_is_not_shown(lat: int, lon: int) -> None:
    state = known(
        mavlink.MAVLink_global_position_int_message(9, lat, lon, 2147483647, 1000, 32767, 0, 0, 0),
        mavlink.MAVLink_home_position_message(lat, lon, 12, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0),
    )
    assert (state.lat_deg, state.lon_deg, state.alt_amsl_m, state.v_north_m_s) == (None, None, None, None)
    assert (state.home_lat_deg, state.home_lon_deg, state.home_alt_amsl_m) == (None, None, None)
    assert (state.alt_rel_home_m, state.ground_speed_m_s) == (1.0, None)


def test_not_a_number_is_missing() -> None:
    state = known(
        mavlink.MAVLink_attitude_message(0, NAN, math.inf, NAN, 0.0, 0.0, 0.0),
        mavlink.MAVLink_vfr_hud_message(NAN, NAN, 0, 0, NAN, -math.inf),
        mavlink.MAVLink_wind_message(NAN, NAN, NAN),
        mavlink.MAVLink_wind_cov_message(0, NAN, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )
    assert (state.roll_rad, state.pitch_rad, state.heading_rad) == (None, None, None)
    assert (state.ground_speed_m_s, state.climb_m_s) == (None, None)
    assert (state.wind_speed_m_s, state.wind_from_rad) == (None, None)
    assert state.wind_t_mono_s is not None


@given(yaw=st.floats(width=32))
def test_heading_lies_within_one_turn(yaw: float) -> None:
    heading = known(mavlink.MAVLink_attitude_message(0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)).heading_rad
    assert (heading is None) != math.isfinite(yaw)
    if heading is not None:
        assert 0 <= heading < math.tau
    if heading is not None and abs(yaw) < 1000:
        assert math.cos(heading) == pytest.approx(math.cos(yaw), abs=1e-6)


def test_batteries_say_what_they_know() -> None:
    status = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16100, 1234, 87, 0, 0, 0, 0, 0, 0)
    cells = [4000, 4010, 4020, 4030] + [65535] * 6
    first = mavlink.MAVLink_battery_status_message(0, 0, 0, 0, cells, -1, 450, -1, -1)
    second = mavlink.MAVLink_battery_status_message(1, 0, 0, 0, [3000] * 10, 100, 9, -1, 10)
    state = known(status)
    assert (state.battery_v, state.battery_a, state.battery_share) == (16.1, 12.34, 0.87)
    state = known(status, first, second)
    assert state.battery_v == pytest.approx(16.06)
    assert (state.battery_a, state.battery_share, state.battery_used_mah) == (12.34, 0.87, 450)
    unknown = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 65535, -1, -1, 0, 0, 0, 0, 0, 0)
    state = known(status, unknown)
    assert (state.battery_v, state.battery_a, state.battery_share) == (16.1, None, 0.87)


def test_a_share_that_one_message_knows_outlives_the_other_until_it_is_old() -> None:
    unknown = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16100, -1, -1, 0, 0, 0, 0, 0, 0)
    nothing = mavlink.MAVLink_battery_status_message(0, 0, 0, 0, [65535] * 10, -1, -1, -1, -1)
    state = known(mavlink.MAVLink_battery_status_message(0, 0, 0, 0, [4000] * 4 + [65535] * 6, -1, 450, -1, 76))
    told = []
    for t_mono_s, message in ((6.0, unknown), (14.0, nothing), (14.9, unknown), (15.1, unknown)):
        state = reduce(state, heard(message), t_mono_s=t_mono_s, t_utc_s=0.0)
        assert state is not None
        told.append((state.battery_share, state.battery_t_mono_s))
    assert told == [(0.76, 5.0), (0.76, 5.0), (0.76, 5.0), (None, 15.1)]


def test_a_voltage_that_one_message_knows_outlives_the_other_until_it_is_old() -> None:
    state = known(mavlink.MAVLink_battery_status_message(0, 0, 0, 0, [4000] * 4 + [65535] * 6, -1, 450, -1, 76))
    unknown = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 65535, -1, 76, 0, 0, 0, 0, 0, 0)
    nothing = mavlink.MAVLink_battery_status_message(0, 0, 0, 0, [65535] * 10, -1, -1, -1, 76)
    told = []
    for t_mono_s, message in ((6.0, unknown), (14.0, nothing), (14.9, unknown), (15.1, unknown), (16.0, nothing)):
        state = reduce(state, heard(message), t_mono_s=t_mono_s, t_utc_s=0.0)
        assert state is not None
        told.append(state.battery_v)
    assert told == [16.0, 16.0, 16.0, None, None]


@pytest.mark.fact("P2")
@pytest.mark.parametrize(("health", "ready"), [(mavlink.MAV_SYS_STATUS_PREARM_CHECK, True), (0, False)])
def test_the_pre_arm_bit_counts_where_it_is_checked(health: int, ready: bool) -> None:
    bit = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    checked = mavlink.MAVLink_sys_status_message(bit, bit, health, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    unchecked = mavlink.MAVLink_sys_status_message(0, bit, health, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    assert known(checked).ready_to_arm is ready
    assert known(unchecked).ready_to_arm is None
    px4 = after(heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4), unchecked)
    assert px4 is not None
    assert px4.ready_to_arm is ready


def text(words: str, number: int = 0, chunk: int = 0) -> Any:
    return mavlink.MAVLink_statustext_message(2, words.encode(), number, chunk)


def test_a_wind_of_exactly_none_is_one_that_the_estimator_has_not_found() -> None:
    blowing, none = mavlink.MAVLink_wind_message(-90.0, 3.0, 0.0), mavlink.MAVLink_wind_message(-180.0, 0.0, 0.0)
    state = known(blowing, none)
    assert (state.wind_speed_m_s, state.wind_from_rad, state.wind_t_mono_s) == (None, None, 5.0)
    light = known(mavlink.MAVLink_wind_message(90.0, 0.01, 0.0))
    assert (light.wind_speed_m_s, light.wind_from_rad) == (pytest.approx(0.01), pytest.approx(math.pi / 2))


def test_what_is_in_the_way_of_arming_is_kept_in_the_vehicles_words_until_it_is_ready() -> None:
    long = "PreArm: Compass 1 is not calibrated, and the vehicle has been moved since"
    spoken = (text(long[:50], 7, 0), text(long[50:], 7, 1), text("PreArm: Battery low"), text("GPS 1: detected u-blox"))
    assert known(*spoken).not_ready_words == (long, "PreArm: Battery low")
    assert known(*spoken, *spoken).not_ready_words == (long, "PreArm: Battery low")
    assert known(text("Preflight Fail: No GPS\t")).not_ready_words == ("Preflight Fail: No GPS",)
    bit = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    ready = mavlink.MAVLink_sys_status_message(bit, bit, bit, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    assert known(*spoken, ready).not_ready_words == ()


def test_reasons_of_an_earlier_look_are_forgotten() -> None:
    state = reduce(known(), heard(text("PreArm: Compass")), t_mono_s=10.0, t_utc_s=0.0)
    for t_mono_s, words in ((40.0, "PreArm: Battery low"), (40.1, "PreArm: Fence")):
        state = reduce(state, heard(text(words)), t_mono_s=t_mono_s, t_utc_s=0.0)
    assert state is not None
    assert state.not_ready_words == ("PreArm: Battery low", "PreArm: Fence")


@pytest.mark.fact("P1")
def test_a_constant_position_is_bad_in_the_air_only() -> None:
    px4 = mavlink.MAV_AUTOPILOT_PX4
    standing = mavlink.MAVLink_estimator_status_message(0, 1023, 0, 0, 0, 0, 0, 0, 0, 0)
    on_ground, in_air = (mavlink.MAVLink_extended_sys_state_message(0, landed) for landed in (1, 2))
    for armed, landed, ok in ((False, on_ground, True), (True, on_ground, True), (True, in_air, False)):
        state = after(heartbeat(px4, base_mode=1 | 128 * armed), landed, standing)
        assert state is not None
        assert state.estimator_ok is ok


def test_gnss_quality() -> None:
    good = mavlink.MAVLink_gps_raw_int_message(0, 6, 1, 1, 1, 121, 200, 0, 0, 10, 0, 15, 25)
    state = known(good)
    assert (state.gnss_fix, state.satellites, state.hdop) == ("rtk_fixed", 10, 1.21)
    assert (state.horizontal_accuracy_m, state.vertical_accuracy_m) == (0.015, 0.025)
    state = known(good, mavlink.MAVLink_gps_raw_int_message(0, 0, 1, 1, 1, 65535, 65535, 0, 0, 255))
    assert (state.gnss_fix, state.satellites, state.hdop, state.horizontal_accuracy_m) == ("none", None, None, None)


@pytest.mark.parametrize(
    ("message", "field", "value"),
    [
        (mavlink.MAVLink_extended_sys_state_message(0, 1), "landed", "on_ground"),
        (mavlink.MAVLink_extended_sys_state_message(0, 0), "landed", None),
        (mavlink.MAVLink_mission_current_message(7, 12), "mission_items", 12),
        (mavlink.MAVLink_mission_current_message(7, 65535), "mission_items", 0),
        (mavlink.MAVLink_mission_current_message(7, 0), "mission_items", None),
        (mavlink.MAVLink_mission_current_message(7, 12), "mission_id", None),
        (mavlink.MAVLink_mission_item_reached_message(4), "mission_reached", 4),
        (mavlink.MAVLink_ekf_status_report_message(831, 0, 0, 0, 0, 0), "estimator_ok", True),
        (mavlink.MAVLink_ekf_status_report_message(831 | 128, 0, 0, 0, 0, 0), "estimator_ok", False),
        (mavlink.MAVLink_ekf_status_report_message(167, 0, 0, 0, 0, 0), "estimator_ok", False),
        (mavlink.MAVLink_estimator_status_message(0, 831, 0, 0, 0, 0, 0, 0, 0, 0), "estimator_ok", True),
        (mavlink.MAVLink_estimator_status_message(0, 831 | 1024, 0, 0, 0, 0, 0, 0, 0, 0), "estimator_ok", False),
        (mavlink.MAVLink_wind_message(-90.0, 3.0, 0.0), "wind_from_rad", 1.5 * math.pi),
        (mavlink.MAVLink_wind_cov_message(0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), "wind_from_rad", 1.5 * math.pi),
        (rc_channels(127), "rc_rssi", 0.5),
        (rc_channels(255), "rc_rssi", None),
        (version(0x04070000), "firmware_version", "4.7.0-dev"),
        (version(0x010F02FF), "firmware_version", "1.15.2"),
        (mavlink.MAVLink_vfr_hud_message(0.0, 4.5, 0, 0, 0.0, 1.5), "ground_speed_m_s", 4.5),
    ],
)  # fmt: skip
def test_single_messages(message: Any, field: str, value: object) -> None:
    assert getattr(known(message), field) == value


@pytest.mark.parametrize(
    ("then", "reached"),
    [
        ((heartbeat(base_mode=129),), 4),
        ((heartbeat(base_mode=1), heartbeat(base_mode=129)), None),
        ((mavlink.MAVLink_mission_current_message(4, 5),), 4),
        ((mavlink.MAVLink_mission_current_message(4, 9),), None),
        ((mavlink.MAVLink_mission_current_message(0, 5),), None),
        ((mavlink.MAVLink_extended_sys_state_message(0, 1), mavlink.MAVLink_mission_current_message(0, 5)), 4),
    ],
)
def test_what_was_reached_is_of_this_flight_and_this_mission_and_does_not_lie_ahead(
    then: tuple[Any, ...], reached: int | None
) -> None:
    current, at = mavlink.MAVLink_mission_current_message(4, 5), mavlink.MAVLink_mission_item_reached_message(4)
    flying = (heartbeat(base_mode=129), mavlink.MAVLink_extended_sys_state_message(0, 2), current, at)
    state = after(*flying, *then)
    assert state is not None
    assert state.mission_reached == reached


def test_the_missions_id_is_read_although_the_dialect_does_not_know_the_field() -> None:
    codec = mavlink.MAVLink(None, 1, 1)
    message = mavlink.MAVLink_mission_current_message(7, 12, 3, 1)
    message.pack(codec)
    payload = bytes([7, 0, 12, 0, 3, 1]) + (0xDEADBEEF).to_bytes(4, "little")
    frame = message._pack(codec, message.crc_extra, payload)
    state = reduce(known(), mavlink.MAVLink(None).decode(bytearray(frame)), t_mono_s=5, t_utc_s=5)
    assert state is not None
    assert state.mission_id == 0xDEADBEEF


def last_states(path: Path, wanted: Callable[[Any], bool] = lambda _: True) -> list[VehicleState]:
    states: list[VehicleState] = []
    state: VehicleState | None = None
    for t_utc_s, message in tlog_messages(path):
        new = reduce(state, message, t_mono_s=t_utc_s, t_utc_s=t_utc_s)
        if new is not None and new is not state and wanted(message):
            states.append(new)
        state = new
    return states


def test_the_recorded_auto_flight(shared_data: Path) -> None:
    states = last_states(shared_data / "logs" / "arducopter" / "auto.tlog")
    last = states[-1]
    assert (last.system_id, last.autopilot, last.vehicle_type, last.firmware_version) == (
        1,
        "ardupilot",
        2,
        "4.7.0-dev",
    )
    assert (last.mode, last.armed, last.landed, last.mission_reached) == ("AUTO", False, "on_ground", 87)
    assert last.home_alt_amsl_m == pytest.approx(803.15, abs=0.5)
    modes = [a.mode for a, b in zip(states, [None, *states], strict=False) if b is None or a.mode != b.mode]
    assert modes[-1] == "AUTO"
    heights = [s.alt_rel_home_m for s in states if s.alt_rel_home_m is not None]
    assert max(heights) == pytest.approx(70, abs=1)
    assert all(s.heading_rad is None or 0 <= s.heading_rad < math.tau for s in states)
    assert last.mission_items == 87
    assert {"on_ground", "taking_off", "in_air", "landing"} <= {s.landed for s in states}


def test_the_recorded_failsafe(shared_data: Path) -> None:
    states = last_states(shared_data / "logs" / "arducopter" / "gcs_failsafe.tlog", is_vehicle_heartbeat)
    changes = [(s.mode, s.critical) for s, before in zip(states, [None, *states], strict=False)
               if before is None or (s.mode, s.critical) != (before.mode, before.critical)]  # fmt: skip
    critical = changes.index(("RTL", True))
    assert changes[critical - 1] == ("AUTO", False)
    assert changes[critical + 1 : critical + 3] == [("RTL", False), ("AUTO", False)]


def test_a_log_with_other_systems_and_bad_spans(shared_data: Path) -> None:
    states = last_states(shared_data / "logs" / "dronekit" / "flight.tlog")
    assert {s.system_id for s in states} == {states[0].system_id}
    assert any(s.armed for s in states)
    assert any(s.mode == "AUTO" for s in states)
    assert all(v is None or math.isfinite(v) for s in states[::50] for v in (s.lat_deg, s.alt_amsl_m, s.battery_v))


def test_a_crossed_fence_is_told_by_its_bit_and_by_its_own_message() -> None:
    bit = mavlink.MAV_SYS_STATUS_GEOFENCE
    kept, crossed, off = (
        mavlink.MAVLink_sys_status_message(on, on, health, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
        for on, health in ((bit, bit), (bit, 0), (0, 0))
    )
    assert [known(message).fence_ok for message in (kept, crossed, off)] == [True, False, None]
    beyond = mavlink.MAVLink_fence_status_message(1, 1, mavlink.FENCE_BREACH_MAXALT, 0)
    within = mavlink.MAVLink_fence_status_message(0, 1, mavlink.FENCE_BREACH_MAXALT, 0)
    assert known().fence_breach is None
    assert known(kept, beyond).fence_breach == "ceiling"
    assert known(kept, beyond, within).fence_breach == "none"
    assert known(kept, beyond, off).fence_breach is None
