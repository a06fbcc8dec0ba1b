"""Times of legs with corner speeds."""

import numpy as np
import pytest

from planning.flight_time.corner_speeds import corner_leg_times
from planning.flight_time.scurve import Axes

AXES = Axes(5.0, 3.0, 1.5, 3.0, 1.0, 6.0, 4.0)


def times(points: list, hold: list | None = None) -> np.ndarray:
    xyz = np.array(points, dtype=np.float64)
    hold_s = np.zeros(len(xyz)) if hold is None else np.array(hold)
    return corner_leg_times(xyz, hold_s, np.full(len(xyz) - 1, 5.0), AXES, 2.0)


def test_a_long_leg_is_length_over_speed_and_the_changes_of_speed() -> None:
    assert times([[0, 0, 0], [300, 0, 0]])[-1] == pytest.approx(60 + 5 / 3 + 3 / 4)


def test_waypoints_on_a_straight_line_cost_nothing() -> None:
    whole = times([[0, 0, 0], [300, 0, 0]])[-1]
    cut = times([[0, 0, 0], [100, 0, 0], [150, 0, 0], [300, 0, 0]])
    assert cut[-1] == pytest.approx(whole, abs=0.3)
    assert np.all(np.diff(cut) > 0)


def test_sharper_corners_take_longer() -> None:
    ends = [times([[0, 0, 0], [50, 0, 0], [50 + 50 * np.cos(a), 50 * np.sin(a), 0]])[-1] for a in (0, 1, 2, 3.1)]
    assert ends == sorted(ends)
    assert ends[-1] > ends[0] + 1


def test_a_hold_stops_the_vehicle() -> None:
    straight = [[0, 0, 0], [50, 0, 0], [100, 0, 0]]
    stopped = times(straight, [0, 2.0, 0])
    alone = times([[0, 0, 0], [50, 0, 0]])[-1]
    np.testing.assert_allclose(stopped, [0, alone + 2, 2 * alone + 2])


def test_vertical_limits_bind_on_steep_legs() -> None:
    assert times([[0, 0, 0], [0, 0, 30]])[-1] > 30 / 3.0
    assert times([[0, 0, 30], [0, 0, 0]])[-1] > 30 / 1.5


def test_a_leg_without_length_takes_no_time() -> None:
    assert times([[0, 0, 0], [0, 0, 0], [50, 0, 0]])[1] == 0
