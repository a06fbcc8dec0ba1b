"""Mode names and numbers go together both ways."""

import pytest

from telemetry.mavlink.modes import mode_name, mode_numbers
from telemetry.topics.vehicle import Autopilot


@pytest.mark.parametrize("name", ["STABILIZE", "AUTO", "GUIDED", "LOITER", "RTL", "LAND", "BRAKE", "SMART_RTL"])
def test_ardupilots(name: str) -> None:
    numbers = mode_numbers("ardupilot", name)
    assert numbers is not None
    assert mode_name("ardupilot", 2, numbers.custom_mode) == name
    assert (numbers.main, numbers.sub) == (numbers.custom_mode, 0)


@pytest.mark.parametrize("name", ["MISSION", "HOLD", "RTL", "LAND", "TAKEOFF", "POSCTL", "OFFBOARD"])
def test_px4s(name: str) -> None:
    numbers = mode_numbers("px4", name)
    assert numbers is not None
    assert mode_name("px4", 2, numbers.custom_mode) == name


@pytest.mark.parametrize(("autopilot", "name"), [("ardupilot", "MISSION"), ("px4", "AUTO"), ("other", "RTL")])
def test_an_autopilot_has_no_modes_of_another(autopilot: Autopilot, name: str) -> None:
    assert mode_numbers(autopilot, name) is None
