"""The corridor along the mission ahead."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.perceiving.braking import Braking
from mapping.perceiving.corridor import MissionLine, length_m, tube_points

places = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(0, 20))
lines = st.lists(places, min_size=2, max_size=6).map(lambda p: np.array(p, np.float64))


def distance_to_line(line: np.ndarray, p: np.ndarray) -> float:
    best = math.inf
    for a, b in pairwise(line):
        d = b - a
        t = np.clip((p - a) @ d / (d @ d), 0, 1) if d @ d > 0 else 0.0
        best = min(best, float(np.linalg.norm(a + t * d - p)))
    return best


def test_length() -> None:
    assert length_m(5.0, Braking()) == pytest.approx(Braking().distance_m(5.0) + 25.0)
    assert length_m(0.0, Braking()) == 0.0


@given(lines, places)
def test_the_first_place_is_the_nearest(line: np.ndarray, position: tuple[float, float, float]) -> None:
    place = MissionLine(line).place(np.array(position))
    away = distance_to_line(line, np.array(position))
    if place is None:
        assert away > 15.0 - 1e-6
    else:
        assert place.distance_m == pytest.approx(away, abs=1e-6)


def test_where_the_line_crosses_itself_the_vehicle_stays_on_its_leg() -> None:
    line = MissionLine(np.array([[-50.0, 0, 5], [50, 0, 5], [50, 50, 5], [0, 50, 5], [0, -50, 5]]))
    for east in np.arange(-50.0, 20.0, 1.0):
        place = line.place(np.array([east, 0.3, 5.0]))
        assert place is not None
        assert place.s_m == pytest.approx(east + 50.0)


def test_a_vehicle_far_off_flies_no_mission() -> None:
    line = MissionLine(np.array([[0.0, 0, 5], [100, 0, 5]]))
    assert line.place(np.array([50.0, 16.0, 5.0])) is None


def test_the_piece_ahead() -> None:
    line = MissionLine(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]]))
    np.testing.assert_allclose(line.ahead(5.0, 10.0), [[5, 0, 0], [10, 0, 0], [10, 5, 0]])
    np.testing.assert_allclose(line.ahead(18.0, 10.0), [[10, 8, 0], [10, 10, 0]])


@pytest.mark.parametrize("points", [[[0, 0, 0]], [[0, 0, 0], [math.nan, 0, 0]]])
def test_what_is_no_line_is_refused(points: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="two finite points"):
        MissionLine(np.array(points, np.float64))


@given(lines, st.floats(0.3, 2.0), st.integers(0, 2**32 - 1))
def test_a_tube_holds_what_is_near_the_line_and_nothing_else(line: np.ndarray, radius: float, seed: int) -> None:
    line = line[:3]
    tube = tube_points(line, radius_m=radius, step_m=radius / 2)
    random = np.random.default_rng(seed)
    for p in tube[random.integers(0, len(tube), 20)]:
        assert distance_to_line(line, p) <= radius + 1e-6
    k = random.integers(0, len(line) - 1)
    inside = line[k] + random.random() * (line[k + 1] - line[k]) + random.uniform(-0.5, 0.5, 3) * radius
    assert np.linalg.norm(tube - inside, axis=1).min() <= radius


def test_a_reach_downwards_grows_with_the_distance() -> None:
    line = np.array([[0.0, 0, 10], [0, 40, 10]])
    tube = tube_points(line, radius_m=0.8, step_m=0.5, reach_down=0.364)
    near, far = tube[np.abs(tube[:, 1] - 4) < 1], tube[np.abs(tube[:, 1] - 39) < 1]
    assert near[:, 2].min() > 10 - 0.8 - 2.0
    assert far[:, 2].min() < 10 - 12.0
    assert far[:, 2].max() <= 10.8 + 1e-9
