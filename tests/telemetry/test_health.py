"""The vehicle's health in words: each row at and beside its limits, and nothing believed that is old."""

import math
from dataclasses import replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import VehicleProfile
from planning.flight_time.return_speeds import ReturnSpeeds
from telemetry.flight.health import Health, HealthRow, way_home_s
from telemetry.mavlink.reduce import reduce
from telemetry.topics.vehicle import VehicleState

PROFILE = VehicleProfile(
    "test", mean_speed_m_s=10.0, max_speed_m_s=10.0, max_climb_m_s=2.0, max_descent_m_s=1.0, endurance_s=1000.0,
    reserve_share=0.2, position_error_m=1.0, rtl_height_m=30.0,
)  # fmt: skip
M_PER_DEG = 111_194.9266


def state(**changes) -> VehicleState:
    known = VehicleState(
        1, 1, "ardupilot", armed=True, landed="in_air", t_utc_s=1000.0, lat_deg=47.0 + 200.0 / M_PER_DEG, lon_deg=8.0,
        alt_rel_home_m=20.0, home_lat_deg=47.0, home_lon_deg=8.0, battery_t_mono_s=100.0, battery_share=0.9,
        gnss_t_mono_s=100.0, gnss_fix="rtk_fixed", horizontal_accuracy_m=0.02,
        vertical_accuracy_m=0.03, estimator_t_mono_s=100.0, estimator_ok=True, estimator_ratio=0.1,
        estimator_ratio_of="velocity", vibration_t_mono_s=100.0, vibration_m_s2=6.0, clipped=0, wind_speed_m_s=2.0,
        wind_from_rad=math.pi / 2,
    )  # fmt: skip
    return replace(known, **changes)


def row(code: str, health: Health | None = None, *, now_mono_s: float | None = 100.5, **changes) -> HealthRow:
    rows = (health or Health()).rows(state(**changes), PROFILE, now_mono_s=now_mono_s)
    return next(each for each in rows if each.code == code)


def test_all_is_well_in_words() -> None:
    rows = Health().rows(state(), PROFILE, now_mono_s=100.5)
    assert [(each.level, each.value, each.limit) for each in rows] == [
        ("good", "Armed", ""),
        ("good", "0.10 (velocity)", "under 0.8"),
        ("good", "RTK fixed, ±0.02 m, height ±0.03 m", "within 1 m"),
        ("good", "6.0 m/s²", "under 30 m/s²"),
        ("good", "90 %, 11 min 40 s to the reserve", "way home 1 min 15 s"),
        ("good", "2.0 m/s from 090°", "under 5.0 m/s"),
    ]


@pytest.mark.parametrize(
    ("code", "changes", "level"),
    [
        ("ready", {"critical": True}, "bad"),
        ("ready", {"armed": False, "ready_to_arm": False, "not_ready_words": ("PreArm: Compass",)}, "bad"),
        ("ready", {"armed": False, "ready_to_arm": None}, "unknown"),
        ("ready", {"armed": False, "ready_to_arm": True}, "good"),
        ("estimator", {"estimator_ratio": 0.49}, "good"),
        ("estimator", {"estimator_ratio": 0.5}, "near"),
        ("estimator", {"estimator_ratio": 0.8}, "bad"),
        ("estimator", {"estimator_ratio": 0.8, "autopilot": "px4"}, "near"),
        ("estimator", {"estimator_ratio": 1.0, "autopilot": "px4"}, "bad"),
        ("estimator", {"estimator_ok": False}, "bad"),
        ("estimator", {"estimator_ratio": None, "estimator_ratio_of": None}, "unknown"),
        ("gnss", {"gnss_fix": "2d"}, "bad"),
        ("gnss", {"vertical_accuracy_m": 1.1}, "near"),
        ("gnss", {"horizontal_accuracy_m": None, "vertical_accuracy_m": None}, "unknown"),
        ("gnss", {"vertical_accuracy_m": None}, "unknown"),
        ("gnss", {"horizontal_accuracy_m": None}, "unknown"),
        ("gnss", {"horizontal_accuracy_m": 1.1, "vertical_accuracy_m": None}, "near"),
        ("vibration", {"vibration_m_s2": 30.0}, "near"),
        ("vibration", {"vibration_m_s2": 60.0}, "bad"),
        ("vibration", {"vibration_m_s2": 6.0, "autopilot": "px4"}, "near"),
        ("vibration", {"vibration_m_s2": None}, "unknown"),
        ("battery", {"battery_share": 0.27}, "bad"),
        ("battery", {"battery_share": 0.32}, "near"),
        ("battery", {"battery_share": 0.35}, "good"),
        ("battery", {"battery_share": None, "battery_v": 15.2}, "unknown"),
        ("wind", {"wind_speed_m_s": 5.0}, "near"),
        ("wind", {"wind_speed_m_s": 8.0}, "bad"),
        ("wind", {"wind_speed_m_s": None}, "unknown"),
    ],
)
def test_each_row_beside_its_limit(code, changes, level) -> None:
    found = row(code, **changes)
    assert found.level == level
    assert found.text or level in ("good", "unknown")


def test_the_vehicles_own_words_are_quoted() -> None:
    found = row("ready", armed=False, ready_to_arm=False, not_ready_words=("PreArm: Compass not calibrated",))
    assert found.text == 'It says: "PreArm: Compass not calibrated".'


@pytest.mark.parametrize("code", ["estimator", "gnss", "vibration", "battery"])
def test_what_is_old_is_not_believed_live_but_in_a_recording(code) -> None:
    assert row(code, now_mono_s=112.4).value == "Not heard for 12 s"
    assert row(code, now_mono_s=112.4).level == "unknown"
    assert row(code, now_mono_s=None).level == "good"
    assert row(code, **{f"{code}_t_mono_s": None}, now_mono_s=None).value == "Not heard yet"


@pytest.mark.parametrize("code", ["ready", "wind"])
def test_a_heartbeat_and_a_wind_of_long_ago_are_no_word_of_now(code) -> None:
    stamp = {"ready": "heartbeat_t_mono_s", "wind": "wind_t_mono_s"}[code]
    fresh: dict[str, Any] = {stamp: 91.0}
    assert row(code, **fresh).level == "good"
    old: dict[str, Any] = {stamp: 88.5}
    found = row(code, **old)
    assert (found.level, found.value, found.limit) == ("unknown", "Not heard for 12 s", "")


def test_what_fell_silent_long_before_the_rest_is_not_believed_in_a_recording_either() -> None:
    for code in ("estimator", "gnss", "vibration", "battery"):
        old: dict[str, Any] = {f"{code}_t_mono_s": 88.0}
        assert row(code, now_mono_s=None, heartbeat_t_mono_s=100.0, **old).value == "Not heard for 12 s"
    assert row("wind", now_mono_s=None, heartbeat_t_mono_s=100.0, wind_t_mono_s=88.0).level == "unknown"
    assert row("wind", now_mono_s=None).level == "good"


@pytest.mark.parametrize("changes", [{"wind_speed_m_s": None}, {"wind_t_mono_s": 88.0}])
def test_a_way_home_without_a_known_wind_says_that_it_counts_on_none(changes) -> None:
    assert row("battery", **changes).limit == "way home 1 min 10 s in still air, for the wind is not known"


def test_the_way_home_is_up_across_against_the_wind_and_down_slowly_at_the_end() -> None:
    down_s = 5 + 20 / 1 + 10 / 0.5
    assert way_home_s(state(), PROFILE) == pytest.approx(10 / 2 + 200 / 8 + down_s, rel=1e-3)
    assert way_home_s(state(wind_speed_m_s=30.0), PROFILE) == pytest.approx(5 + 200 / 0.5 + down_s, rel=1e-3)
    assert way_home_s(state(alt_rel_home_m=60.0), PROFILE) == pytest.approx(200 / 8 + 30 + down_s, rel=1e-3)
    assert way_home_s(state(home_lat_deg=None), PROFILE) is None
    assert way_home_s(state(armed=False), PROFILE) is None


def test_the_way_home_is_flown_at_the_vehicles_own_speeds_and_at_the_worse_end_where_they_are_not_read() -> None:
    own = ReturnSpeeds(4.0, 1.0, 0.5, 0.3, 5.0, 2.0)
    assert way_home_s(state(), PROFILE, own) == pytest.approx(10 / 1 + 200 / 4 + 2 + 25 / 0.5 + 5 / 0.3, rel=1e-3)
    assert way_home_s(state(wind_speed_m_s=7.0), PROFILE, own) == pytest.approx(78.667 + 200 / 3, rel=1e-3)
    fast = ReturnSpeeds(25.0, 9.0, 9.0, 0.5, 10.0, 5.0)
    assert way_home_s(state(), PROFILE, fast) == way_home_s(state(), PROFILE, ReturnSpeeds(10.0)), "as the profile may"
    slower = replace(PROFILE, mean_speed_m_s=4.0)
    assert way_home_s(state(), slower) == pytest.approx(5 + 200 / 4 + 45, rel=1e-3)


def test_the_way_home_leads_over_the_vehicles_own_return_height_and_what_does_not_land_is_said() -> None:
    higher = ReturnSpeeds(height_m=100.0, lands=False)
    assert way_home_s(state(), PROFILE, higher) == pytest.approx(80 / 2 + 200 / 8 + 5 + 90 / 1 + 10 / 0.5, rel=1e-3)
    assert way_home_s(state(), PROFILE, ReturnSpeeds(height_m=5.0)) == way_home_s(state(), PROFILE)
    told = next(each for each in Health().rows(state(), PROFILE, returns=higher) if each.code == "battery")
    assert "hovers until it is landed" in told.limit


def test_a_battery_that_goes_down_faster_than_set_counts_as_it_goes_down() -> None:
    health = Health()
    for second in range(0, 121, 10):
        health.on_state(state(t_utc_s=1000.0 + second, battery_share=0.9 - second / 400))
    found = row("battery", health, t_utc_s=1120.0, battery_share=0.6)
    assert found.value == "60 %, 2 min 40 s to the reserve"
    health.on_state(state(t_utc_s=1130.0, battery_share=1.0))  # swapped
    assert row("battery", health, t_utc_s=1131.0, battery_share=1.0).value == "100 %, 13 min 20 s to the reserve"


def test_a_battery_of_an_unknown_vehicle_has_no_made_up_time() -> None:
    rows = Health().rows(state(battery_share=0.22), None, now_mono_s=100.5)
    battery = next(each for each in rows if each.code == "battery")
    assert (battery.value, battery.level) == ("22 %", "near")


def test_clipped_samples_count_while_they_are_new() -> None:
    health = Health()
    for second, clipped in ((0, 7), (5, 7), (6, 19)):
        health.on_state(state(t_utc_s=1000.0 + second, clipped=clipped))
    found = row("vibration", health)
    assert (found.level, found.text[:10]) == ("bad", "12 samples")
    for second in (20, 30, 37):
        health.on_state(state(t_utc_s=1000.0 + second, clipped=19))
    assert row("vibration", health).level == "good"


def told(autopilot: int, message) -> VehicleState:
    beat = mavlink.MAVLink_heartbeat_message(2, autopilot, 81, 0, 4, 3)
    known = None
    for each in (beat, message):
        each._header.srcSystem, each._header.srcComponent = 1, 1
        known = reduce(known, each, t_mono_s=5.0, t_utc_s=6.0)
    assert known is not None
    return known


def test_both_autopilots_tell_vibration_and_estimator_their_own_way() -> None:
    vibration = mavlink.MAVLink_vibration_message(0, 3.0, 40.0, 2.0, 1, 2, 3)
    assert (told(3, vibration).vibration_m_s2, told(3, vibration).clipped) == (40.0, 6)
    assert told(12, vibration).vibration_m_s2 == 2.0
    ekf = told(3, mavlink.MAVLink_ekf_status_report_message(831, 0.1, 0.2, 0.6, 0.3, math.nan))
    assert (ekf.estimator_ratio, ekf.estimator_ratio_of) == (pytest.approx(0.6), "height")
    px4 = told(12, mavlink.MAVLink_estimator_status_message(0, 831, 0.1, 0.9, 0.2, 0.3, 0, math.nan, 1, 1))
    assert (px4.estimator_ratio, px4.estimator_ratio_of) == (pytest.approx(0.9), "place")
