"""The row of the check about avoidance: eyes or none, how far, how fast; and the way home that flies faster."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mapping.perceiving.braking import Braking
from telemetry.flight.preflight.checks import Row
from telemetry.flight.preflight.eyes_check import avoidance_row
from telemetry.flight.preflight.parameters import Speeds, flown_speeds
from telemetry.topics.obstacles import AvoidanceStatus, Eye
from telemetry.topics.onboard_lists import Item, OnboardMission

RADAR = Eye("radar", 100.0, 10.0, 4.1)
ON = AvoidanceStatus(enabled=True, state="watching", eyes=(RADAR,))
REAL = {"RTL_SPEED": 0.0, "WPNAV_SPEED": 1000.0, "PSC_JERK_XY": 5.0}
"""ArduCopter's defaults, in centimetres."""
NONE = (0.0, 0.0, 0.0, 0.0)


def row(status: AvoidanceStatus, speeds: Speeds | None = None) -> Row:
    return avoidance_row(status, speeds or Speeds(4.0, 4.0, "RTL_SPEED", 5.0), Braking(), utc_minus_mono_s=0.0)


def onboard(*speeds_m_s: float | None) -> OnboardMission:
    """A waypoint after each speed; None: no item sets one."""
    items: list[Item] = []
    for speed in speeds_m_s:
        if speed is not None:
            items.append(Item(178, 2, (1.0, speed, -1.0, 0.0), 0.0, 0.0, 0.0))
        items.append(Item(16, 3, NONE, 1.0, 1.0, 8.0))
    return OnboardMission(tuple(items), 1.0, 1.0, 0.0, "digest")


@pytest.mark.fact("A42")
def test_switched_on_without_eyes_it_wants_to_be_accepted() -> None:
    blind = row(AvoidanceStatus(enabled=True, state="blind"))
    assert (blind.code, blind.state) == ("avoidance", "accept")
    assert "no sensor sees ahead" in blind.text
    assert row(AvoidanceStatus()).state == "good"
    assert "off" in row(AvoidanceStatus()).text


def test_it_says_who_sees_since_when_how_far_and_for_what_speed() -> None:
    seen = row(ON)
    assert (seen.state, seen.mend) == ("good", "")
    assert seen.text == "Radar: 10 m ahead since 00:01:40 UTC, enough for 4.1 m/s."
    two = row(replace(ON, eyes=(RADAR, Eye("vision", 160.0, 7.0, 2.7))), Speeds(3.0, 2.5, "RTL_SPEED", 5.0))
    assert "Vision: 7 m ahead since 00:02:40 UTC, enough for 2.7 m/s." in two.text
    assert two.state == "accept", "what only the camera sees must be stopped for, too"


def test_a_mission_that_is_faster_than_its_sensors_see_is_to_be_accepted() -> None:
    fast = row(ON, Speeds(6.0, 4.0, "RTL_SPEED", 5.0))
    assert fast.state == "accept"
    assert "The mission flies at 6.0 m/s: it will be slowed." in fast.text
    assert row(ON, Speeds(4.1, 4.0, "RTL_SPEED", 5.0)).state == "good"


@pytest.mark.fact("A41")
@pytest.mark.parametrize(
    ("parameters", "value"),
    [
        (REAL, "Set RTL_SPEED 410 cm/s on the vehicle."),
        ({**REAL, "RTL_SPEED": 800.0}, "Set RTL_SPEED 410 cm/s on the vehicle."),
        ({"RTL_SPEED_MS": 0.0, "WP_SPD": 10.0, "PSC_JERK_NE": 5.0}, "Set RTL_SPEED_MS 4.1 m/s on the vehicle."),
    ],
)
def test_a_way_home_that_is_too_fast_is_said_with_the_value_to_set(parameters: dict[str, float], value: str) -> None:
    speeds = flown_speeds(parameters, onboard(4.0), "ardupilot")
    assert "The way home is flown at" in row(ON, speeds).text
    assert row(ON, speeds).mend == value
    slow = flown_speeds({**parameters, "RTL_SPEED": 400.0, "RTL_SPEED_MS": 4.0}, onboard(4.0), "ardupilot")
    assert row(ON, slow).mend == ""


def test_a_vehicle_that_brakes_more_softly_than_its_profile_says_is_to_be_accepted() -> None:
    soft = row(ON, Speeds(4.0, 4.0, "RTL_SPEED", 3.0))
    assert soft.state == "accept"
    assert soft.mend == "Set 5 on the vehicle, or 3 in its profile."


def test_speeds_are_the_largest_of_the_mission_and_what_is_not_known_is_not_told() -> None:
    assert flown_speeds(REAL, onboard(3.0, 5.0, 2.0), "ardupilot").mission_m_s == 5.0
    assert flown_speeds(REAL, onboard(None, 2.0), "ardupilot").mission_m_s == 10.0
    assert flown_speeds({}, onboard(None, 2.0), "ardupilot") == Speeds()
    assert flown_speeds({}, onboard(2.0), "ardupilot").mission_m_s == 2.0
    assert flown_speeds({**REAL, "RTL_SPEED": 300.0}, None, "ardupilot") == Speeds(None, 3.0, "RTL_SPEED", 5.0)
    assert flown_speeds(REAL, onboard(3.0), "px4") == Speeds()


def test_a_sensor_that_is_late_is_to_be_accepted() -> None:
    late = row(replace(ON, eyes=(replace(RADAR, is_late=True),)))
    assert late.state == "accept"
    assert "Frames from radar come over 0.5 s late: it brakes later, and then holds." in late.text
