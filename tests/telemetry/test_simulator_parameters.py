"""The simulated autopilot's parameters."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS, Parameters


@settings(deadline=None)
@given(st.sampled_from(sorted(SPECS)), st.floats())
def test_values_stay_in_range_whatever_is_sent(name: str, value: float) -> None:
    parameters = Parameters()
    before = parameters[name]
    kept = parameters.set(name, value)
    assert kept == parameters[name]
    assert SPECS[name].low <= kept <= SPECS[name].high
    assert math.isfinite(kept)
    assert SPECS[name].kind == "float" or kept == round(kept)
    if not math.isfinite(value):
        assert kept == before


def test_the_old_and_the_new_name_of_the_system_id_are_one() -> None:
    parameters = Parameters()
    parameters.set("SYSID_THISMAV", 7)
    assert parameters["MAV_SYSID"] == 7
    parameters.set("MAV_SYSID", 9)
    assert parameters["SYSID_THISMAV"] == 9


def test_navigation_limits_come_in_metres() -> None:
    axes = Parameters(WPNAV_SPEED=300, WPNAV_SPEED_UP=200, WPNAV_SPEED_DN=150).axes()
    assert (axes.speed_m_s, axes.climb_m_s, axes.descent_m_s, axes.accel_m_s2) == (3.0, 2.0, 1.5, 2.5)
    assert axes.corner_accel_m_s2 == 5.0
    assert Parameters(WPNAV_ACCEL_C=300).axes(1.5).corner_accel_m_s2 == 3.0
    assert Parameters().axes(1.5).speed_m_s == 1.5


def test_navigation_limits_are_those_of_now() -> None:
    """They are kept between steps of a flight."""
    parameters = Parameters(WPNAV_SPEED=300)
    assert [parameters.axes(speed_m_s).speed_m_s for speed_m_s in (None, 2.0, 2.5, None)] == [3.0, 2.0, 2.5, 3.0]
    parameters.set("WPNAV_SPEED", 400)
    parameters.set("WPNAV_ACCEL_Z", 150)
    assert (parameters.axes().speed_m_s, parameters.axes().vertical_accel_m_s2) == (4.0, 1.5)


def test_an_unknown_name_is_an_error() -> None:
    with pytest.raises(KeyError):
        Parameters(NO_SUCH=1)
