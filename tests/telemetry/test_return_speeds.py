"""At which speeds a vehicle comes home, by its own settings under whatever names they have."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planning.basics.plan_model import VehicleProfile
from planning.flight_time.predict import predict_duration
from planning.flight_time.return_speeds import ReturnSpeeds, worse_pace
from telemetry.flight.preflight.parameters import NAMES, return_speeds
from tests.planning.test_flight_time import LEVEL, PROFILE, waypoints

OLD = {
    "RTL_SPEED": 400.0,
    "WPNAV_SPEED": 1000.0,
    "WPNAV_SPEED_UP": 250.0,
    "WPNAV_SPEED_DN": 150.0,
    "LAND_SPEED": 50.0,
    "LAND_SPEED_HIGH": 0.0,
    "LAND_ALT_LOW": 1000.0,
    "RTL_LOIT_TIME": 5000.0,
}
NEW = {
    "RTL_SPEED_MS": 4.0,
    "WP_SPD": 10.0,
    "WP_SPD_UP": 2.5,
    "WP_SPD_DN": 1.5,
    "LAND_SPD_MS": 0.5,
    "LAND_SPD_HIGH_MS": 0.0,
    "LAND_ALT_LOW_M": 10.0,
    "RTL_LOIT_TIME": 5000.0,
}
PX4 = {
    "MPC_XY_CRUISE": 5.0,
    "MPC_Z_V_AUTO_UP": 3.0,
    "MPC_Z_V_AUTO_DN": 1.5,
    "MPC_LAND_SPEED": 0.7,
    "MPC_LAND_ALT1": 10.0,
    "RTL_LAND_DELAY": 0.0,
}
KNOWN = ReturnSpeeds(4.0, 2.5, 1.5, 0.5, 10.0, 5.0)


@pytest.mark.parametrize("parameters", [OLD, NEW])
def test_ardupilots_names_of_all_versions_say_the_same(parameters: dict[str, float]) -> None:
    assert return_speeds(parameters, "ardupilot") == KNOWN
    assert set(parameters) <= set(NAMES["ardupilot"])


def test_no_return_speed_of_its_own_is_the_cruising_speed_and_a_landing_may_be_faster_high_up() -> None:
    assert return_speeds(OLD | {"RTL_SPEED": 0.0}, "ardupilot").level_m_s == 10.0
    assert return_speeds(OLD | {"LAND_SPEED_HIGH": 80.0}, "ardupilot").descent_m_s == 0.8


def test_px4_returns_at_its_cruising_speed_and_lands_slowly_from_where_it_begins_to() -> None:
    assert return_speeds(PX4, "px4") == ReturnSpeeds(5.0, 3.0, 1.5, 0.7, 10.0, 0.0)
    waits = return_speeds(PX4 | {"RTL_LAND_DELAY": -1.0}, "px4")
    assert (waits.wait_s, waits.lands) == (0.0, False)
    assert set(PX4) <= set(NAMES["px4"])


def test_a_return_is_as_high_as_it_is_set_and_ends_in_the_air_where_that_is_set() -> None:
    assert return_speeds(OLD | {"RTL_ALT": 10000.0}, "ardupilot").height_m == 100.0
    assert return_speeds({"RTL_ALT_M": 40.0, "RTL_ALT_FINAL_M": 5.0}, "ardupilot") == ReturnSpeeds(
        height_m=40.0, lands=False
    )
    assert return_speeds(PX4 | {"RTL_RETURN_ALT": 60.0}, "px4").height_m == 60.0
    assert not return_speeds(OLD | {"RTL_ALT_FINAL": 200.0}, "ardupilot").lands


def test_the_higher_of_both_return_heights_is_climbed_to() -> None:
    profile = VehicleProfile("any", mean_speed_m_s=3.0, max_speed_m_s=5.0)
    mission, low = waypoints([(0, 0, 10), (300, 0, 10)]), replace(KNOWN, height_m=1.0)
    seconds = [predict_duration(mission, PROFILE, LEVEL, returns=own).return_s for own in (KNOWN, low)]
    assert seconds[0] == seconds[1]
    high = predict_duration(mission, PROFILE, LEVEL, returns=replace(KNOWN, height_m=PROFILE.rtl_height_m + 60.0))
    assert high.return_s - seconds[0] == pytest.approx(60 / min(2.5, PROFILE.max_climb_m_s) + 60 / 1.5, rel=0.05)
    assert worse_pace(ReturnSpeeds(), profile).height_m == profile.rtl_height_m


def test_what_was_not_read_or_is_no_number_is_not_known() -> None:
    for firmware in ("ardupilot", "px4"):
        assert return_speeds({}, firmware) == ReturnSpeeds()
        assert return_speeds(dict.fromkeys(OLD | PX4), firmware) == ReturnSpeeds()
    assert return_speeds({"WPNAV_SPEED": float("nan")}, "ardupilot") == ReturnSpeeds()


def test_the_worse_end_is_never_faster_than_the_profile() -> None:
    profile = VehicleProfile("any", mean_speed_m_s=3.0, max_speed_m_s=5.0)
    assert worse_pace(ReturnSpeeds(), profile).level_m_s == 3.0
    assert worse_pace(ReturnSpeeds(10.0, 9.0, 9.0), profile).level_m_s == 5.0
    assert worse_pace(ReturnSpeeds(0.0), profile).level_m_s == 3.0
    assert worse_pace(replace(KNOWN, level_m_s=1.0), profile).level_m_s == 1.0


def test_a_slower_return_is_a_longer_flight_by_just_that_way() -> None:
    mission = waypoints([(0, 0, 10), (300, 0, 10)])
    fast, slow = (
        predict_duration(mission, PROFILE, LEVEL, returns=replace(KNOWN, level_m_s=speed_m_s))
        for speed_m_s in (4.0, 1.0)
    )
    assert slow.flight_s == fast.flight_s
    assert slow.return_s - fast.return_s == pytest.approx(300 / 1.0 - 300 / 4.0, abs=5.0)
