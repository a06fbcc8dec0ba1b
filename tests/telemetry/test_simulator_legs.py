"""S-curve legs of the simulated autopilot."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.flight_time.scurve import Axes, leg
from telemetry.simulation.simulator.autopilot.leg_curves import LegTrack, along
from telemetry.simulation.simulator.neu_frame import Vec3

STEP_S = 0.01
AXES = Axes(5.0, 2.5, 1.5, 2.5, 1.0, 5.0, 1.0)
places = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-20, 20))


def flown(points: list[Vec3], *, joined: bool) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Positions and velocities (N, 3) of the target, and when each waypoint was passed."""
    track, positions, velocities, passed = LegTrack(points[0], 2.0), [], [], []
    t_s = 0.0
    for k, goal in enumerate(points[1:], start=1):
        after = points[k + 1] if joined and k + 1 < len(points) else None
        track.go_on(goal, AXES, (after, AXES) if after else None)
        while not track.passed:
            track.advance(STEP_S)
            t_s += STEP_S
            p, v, _ = track.target()
            positions.append(p)
            velocities.append(v)
        passed.append(t_s)
    return np.array(positions), np.array(velocities), passed


@settings(deadline=None, max_examples=15)
@given(st.lists(places, min_size=2, max_size=6, unique=True), st.booleans())
def test_the_target_never_jumps_and_ends_at_the_last_waypoint(points: list[Vec3], joined: bool) -> None:
    positions, velocities, _ = flown(points, joined=joined)
    if not len(positions):
        return
    fastest = math.hypot(2 * AXES.speed_m_s, 2 * AXES.climb_m_s)
    jumps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    assert (jumps <= fastest * STEP_S + 1e-6).all()
    assert (np.linalg.norm(np.diff(velocities, axis=0), axis=1) <= 12 * STEP_S + 1e-6).all()
    assert math.dist(positions[-1], points[-1]) < 0.05


def test_a_cut_corner_stays_near_the_waypoint_and_saves_time() -> None:
    points: list[Vec3] = [(0.0, 0.0, 10.0), (30.0, 0.0, 10.0), (30.0, 30.0, 10.0)]
    cut, _, cut_s = flown(points, joined=True)
    stopped, _, stopped_s = flown(points, joined=False)
    assert cut_s[-1] < stopped_s[-1]
    assert 0.01 < np.linalg.norm(cut - points[1], axis=1).min() < 2.0
    assert np.linalg.norm(stopped - points[1], axis=1).min() < 0.01


def test_a_leg_of_no_length_is_passed_at_once() -> None:
    track = LegTrack((1.0, 1.0, 1.0), 2.0)
    track.go_on((1.0, 1.0, 1.0), AXES, ((9.0, 1.0, 1.0), AXES))
    assert track.passed
    assert track.target()[0] == (1.0, 1.0, 1.0)


@settings(deadline=None)
@given(st.floats(0.1, 300))
def test_a_leg_begins_and_ends_at_rest(length_m: float) -> None:
    this = leg(np.array([length_m, 0.0, 0.0]), AXES)
    assert along(this, 0.0) == pytest.approx((0, 0, 0))
    assert along(this, this.duration_s) == pytest.approx((length_m, 0, 0), abs=1e-6)
    x, v, a = along(this, this.duration_s / 2)
    assert x == pytest.approx(length_m / 2, rel=1e-6)
    assert v <= AXES.speed_m_s + 1e-6
    assert abs(a) < 1e-3 or this.cruise_s == 0
