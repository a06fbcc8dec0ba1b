"""The law of ArduCopter's BRAKE: against what was measured, against its own loop in small steps, and its limits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.perceiving.braking import LEAN_M_S2, Braking, Stopping

MEASURED_M = {3.0: 4.8, 4.0: 6.7, 5.0: 8.8, 6.2: 11.3, 8.0: 15.4}
"""ArduCopter 4.7, default parameters: from BRAKE to standstill."""


@pytest.mark.fact("A39")
@pytest.mark.parametrize(("speed_m_s", "measured_m"), MEASURED_M.items())
def test_it_is_what_the_real_vehicle_needed_and_never_less(speed_m_s: float, measured_m: float) -> None:
    assert measured_m <= Braking().distance_m(speed_m_s) <= measured_m + 0.3


@pytest.mark.fact("A40")
@pytest.mark.parametrize(("speed_m_s", "mean_m_s2"), [(3.0, 0.93), (5.0, 1.4), (6.2, 1.7)])
def test_in_the_mean_it_is_the_softer_the_slower_it_was(speed_m_s: float, mean_m_s2: float) -> None:
    """Where a constant 2.5 m/s2 was believed."""
    assert speed_m_s**2 / (2 * Braking().distance_m(speed_m_s)) == pytest.approx(mean_m_s2, rel=0.06)


def in_small_steps_m(braking: Braking, speed_m_s: float) -> float:
    """AP_Math's shape_vel_accel, as its loop runs it."""
    v, a, way_m, dt = speed_m_s, 0.0, 0.0, 1e-3
    while v > 1e-3:
        wish = min(v * braking.jerk_m_s3 / braking.decel_m_s2, braking.decel_m_s2, LEAN_M_S2)
        a += max(-braking.jerk_m_s3 * dt, min(braking.jerk_m_s3 * dt, wish - a))
        v -= a * dt
        way_m += v * dt
    return way_m


@pytest.mark.parametrize("speed_m_s", [0.5, 3.0, 8.0, 12.0, 20.0])
@pytest.mark.parametrize("braking", [Braking(), Braking(jerk_m_s3=3.0), Braking(decel_m_s2=2.5, jerk_m_s3=20.0)])
def test_the_closed_form_is_the_loop(braking: Braking, speed_m_s: float) -> None:
    assert braking.distance_m(speed_m_s) == pytest.approx(in_small_steps_m(braking, speed_m_s), rel=0.01, abs=0.01)


@given(st.floats(0.0, 30.0), st.floats(0.05, 5.0), st.floats(1.0, 10.0), st.floats(1.0, 20.0))
def test_faster_never_stops_sooner(speed_m_s: float, more_m_s: float, decel: float, jerk: float) -> None:
    braking = Braking(decel, jerk)
    assert braking.distance_m(speed_m_s + more_m_s) > braking.distance_m(speed_m_s) >= 0.0


@given(st.floats(0.0, 100.0), st.floats(0.0, 2.0), st.floats(0.0, 3.0))
def test_at_the_largest_speed_a_region_just_suffices(depth_m: float, latency_s: float, keep_m: float) -> None:
    stopping = Stopping(Braking(), latency_s, keep_m)
    speed_m_s = stopping.largest_speed_m_s(depth_m)
    if depth_m <= keep_m:
        assert speed_m_s == 0.0
    else:
        assert stopping.distance_m(speed_m_s) == pytest.approx(depth_m, abs=1e-6)


@pytest.mark.fact("A37")
def test_the_papers_regions_suffice_for_less_than_was_believed() -> None:
    """A constant 2.5 m/s2 allowed 6.2 m/s for 10 m."""
    stopping = Stopping(Braking(), 0.4, 1.15)
    assert 3.7 < stopping.largest_speed_m_s(10.0) < 4.3
    assert math.isclose(stopping.distance_m(0.0), 1.15)
