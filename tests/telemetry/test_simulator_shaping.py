"""Targets with limited speed, acceleration and jerk."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.flight_time.scurve import Axes
from telemetry.simulation.simulator.autopilot.shaping import JERK_M_S3, Shaped, approach_speed, stopping_point

STEP_S = 0.01
AXES = Axes(5.0, 2.5, 1.5, 2.5, 1.0, 5.0, 1.0)
goals = st.tuples(st.floats(-60, 60), st.floats(-60, 60), st.floats(-20, 20))
velocities = st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-1, 1))


@settings(deadline=None, max_examples=12)
@given(goals, velocities)
def test_arrives_within_all_limits(goal: tuple[float, float, float], v_neu: tuple[float, float, float]) -> None:
    target = Shaped((0.0, 0.0, 0.0), v_neu)
    before = target.accel_neu
    fastest = max(AXES.speed_m_s, math.hypot(*v_neu[:2]))
    for _ in range(9000):
        target.towards(goal, AXES, STEP_S)
        north, east, up = target.accel_neu
        assert math.hypot(north, east) <= AXES.accel_m_s2 + 1e-6
        assert abs(up) <= AXES.vertical_accel_m_s2 + 1e-6
        assert math.hypot(north - before[0], east - before[1]) <= JERK_M_S3 * STEP_S + 1e-9
        assert math.hypot(*target.v_neu[:2]) <= fastest + 0.3
        assert -AXES.descent_m_s - 0.3 <= target.v_neu[2] <= AXES.climb_m_s + 0.3
        before = target.accel_neu
    assert math.dist(target.p_neu, goal) < 0.02


@settings(deadline=None, max_examples=30)
@given(velocities)
def test_the_stopping_point_is_where_it_stops(v_neu: tuple[float, float, float]) -> None:
    target = Shaped((1.0, 2.0, 3.0), v_neu)
    expected = stopping_point(target, AXES)
    for _ in range(2000):
        target.stop(AXES, STEP_S)
    assert math.dist(target.p_neu, expected) < 0.1
    assert target.at_rest


def test_a_steep_way_is_flown_straight() -> None:
    target, goal = Shaped((0.0, 0.0, 0.0)), (40.0, 0.0, 40.0)
    off = []
    for _ in range(2500):
        target.towards(goal, AXES, STEP_S)
        off.append(abs(target.p_neu[0] - target.p_neu[2]))
    assert max(off) < 3.0
    assert math.dist(target.p_neu, goal) < 0.1


@settings(deadline=None)
@given(st.floats(0, 200), st.floats(0, 200), st.floats(0.1, 5))
def test_approach_speed_grows_with_distance_and_can_be_braked(a: float, b: float, decel: float) -> None:
    near, far = sorted((a, b))
    assert approach_speed(near, decel) <= approach_speed(far, decel) + 1e-9
    assert approach_speed(far, decel) ** 2 <= 2 * decel * far + 1e-6


def test_sinks_at_the_speed_asked() -> None:
    target = Shaped((0.0, 0.0, 30.0))
    for _ in range(500):
        target.sinking((1.0, 0.0, 0.0), 1.2, AXES, STEP_S)
    assert target.v_neu[2] == pytest.approx(-1.2, abs=0.01)
    assert np.allclose(target.p_neu[:2], (1.0, 0.0), atol=0.1)
