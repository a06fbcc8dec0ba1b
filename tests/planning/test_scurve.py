"""The S-curve of one leg and the corner between two."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.flight_time.scurve import INPUT_TIME_CONSTANT_S, Axes, LegLimits, leg, overlap_s, speed_up

AXES = Axes(3.0, 2.0, 1.5, 2.5, 1.0, 5.0, 1.0)
limits = st.builds(LegLimits, st.floats(0.2, 20), st.floats(0.2, 6), st.floats(0.2, 10))


@settings(deadline=None)
@given(limits, st.floats(0.05, 500))
def test_the_rise_keeps_its_limits_and_its_half_of_the_leg(within: LegLimits, half_m: float) -> None:
    rise = speed_up(half_m, within)
    times = np.linspace(0, rise.duration_s, 400)
    x, v, a = np.array([rise.at(float(t)) for t in times]).T
    assert v.max() <= within.speed_m_s * (1 + 1e-6)
    assert a.max() <= within.accel_m_s2 * (1 + 1e-6)
    assert np.abs(np.diff(a)).max() <= within.jerk_m_s3 * times[1] * (1 + 1e-6)
    assert x[-1] <= half_m * (1 + 1e-6)
    assert (x[-1], v[-1]) == pytest.approx((rise.distance_m, rise.speed_m_s), rel=1e-6)
    reached = v[-1] >= within.speed_m_s * (1 - 1e-6)
    assert reached or x[-1] >= half_m * (1 - 1e-6)


@settings(deadline=None)
@given(limits, st.floats(0.1, 100))
def test_distance_speed_and_acceleration_are_integrals_of_each_other(within: LegLimits, half_m: float) -> None:
    rise = speed_up(half_m, within)
    times = np.linspace(0, rise.duration_s, 4001)
    x, v, a = np.array([rise.at(float(t)) for t in times]).T
    dt = times[1]
    np.testing.assert_allclose(np.cumsum((v[1:] + v[:-1]) / 2) * dt, x[1:], atol=1e-4 * half_m)
    np.testing.assert_allclose(np.cumsum((a[1:] + a[:-1]) / 2) * dt, v[1:], atol=1e-4 * within.speed_m_s)


def test_a_weak_pulse_has_less_jerk_for_the_same_snap() -> None:
    rise = speed_up(1e-3, LegLimits(3.0, 2.5, 1.0))
    assert rise.ramp_s < 2 * INPUT_TIME_CONSTANT_S
    assert rise.jerk_m_s3 / rise.ramp_s == pytest.approx(1.0 / (2 * INPUT_TIME_CONSTANT_S))


def test_vertical_limits_bind_on_steep_legs() -> None:
    up, down, level = (leg(np.array(d), AXES) for d in ([3.0, 0, 4.0], [3.0, 0, -4.0], [5.0, 0, 0]))
    assert up.limits.speed_m_s == pytest.approx(2.0 / 0.8)
    assert down.limits.speed_m_s == pytest.approx(1.5 / 0.8)
    assert level.limits.speed_m_s == 3.0
    assert up.limits.accel_m_s2 == pytest.approx(1.0 / 0.8)


@settings(deadline=None)
@given(st.floats(0.1, 1000))
def test_longer_legs_take_longer_and_long_ones_cruise(length_m: float) -> None:
    shorter, longer = leg(np.array([length_m, 0, 0]), AXES), leg(np.array([1.1 * length_m, 0, 0]), AXES)
    assert shorter.duration_s < longer.duration_s
    assert shorter.duration_s >= length_m / 3.0
    if length_m > 100:
        assert longer.duration_s - shorter.duration_s == pytest.approx(0.1 * length_m / 3.0, rel=1e-6)


def test_straight_on_legs_overlap_fully_so_that_long_ones_keep_their_speed() -> None:
    this = leg(np.array([50.0, 0, 0]), AXES)
    joined = overlap_s(this, this, AXES, radius_m=20.0)
    assert joined == pytest.approx(this.rise.duration_s)
    assert 2 * this.duration_s - joined == pytest.approx(leg(np.array([100.0, 0, 0]), AXES).duration_s)


def test_sharper_corners_overlap_less_and_so_does_a_smaller_radius() -> None:
    this = leg(np.array([50.0, 0, 0]), AXES)
    turns = np.radians([0, 45, 90, 135, 180])
    nexts = [leg(50 * np.array([np.cos(t), np.sin(t), 0.0]), AXES) for t in turns]
    wide = [overlap_s(this, following, AXES, radius_m=2.0) for following in nexts]
    narrow = [overlap_s(this, following, AXES, radius_m=0.2) for following in nexts]
    assert all(a >= b for a, b in pairwise(wide))
    assert wide[-1] > 0
    assert all(a <= b for a, b in zip(narrow, wide, strict=True))
