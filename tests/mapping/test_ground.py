"""Known ground: which points the surface model explains."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.perceiving.ground import ground_grid
from tests.reference.ground import shell_distance

NORTH_UP = np.array([[0.0, -2.0, 20.0], [2.0, 0.0, 20.0]])
"""Cells of 0.5 m, 40 x 40, the origin in the middle."""
coordinates = st.floats(-12, 12)


def hillside(slope: float) -> np.ndarray:
    """Rising to the east, up = 0 at east = 0."""
    east = (np.arange(40) + 0.5) * 0.5 - 10
    return np.broadcast_to(east * slope, (40, 40)).astype(np.float32)


def test_heights() -> None:
    grid = ground_grid(hillside(1.0), NORTH_UP)
    np.testing.assert_allclose(grid.up([[3.1, 5.0], [-3.1, -9.9]]), [3.25, -3.25])
    assert np.isnan(grid.up([[10.1, 0.0], [0.0, -10.1]])).all()


@settings(max_examples=30)
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(coordinates, coordinates, st.floats(-6, 10)), min_size=1, max_size=12),
    st.floats(0.2, 2.5),
)
def test_points_against_the_slow_form(seed: int, points: list[tuple[float, float, float]], within_m: float) -> None:
    random = np.random.default_rng(seed)
    up = np.round(random.normal(0, 2, (12, 14)), 2).astype(np.float32)
    up[random.random(up.shape) < 0.1] = np.nan
    turned = 0.3
    to_cell = np.array([[math.sin(turned), -math.cos(turned), 6.0], [math.cos(turned), math.sin(turned), 7.0]])
    grid = ground_grid(up, to_cell)
    explained = grid.explains_points(np.array(points), within_m)
    for point, verdict in zip(points, explained, strict=True):
        distance = shell_distance(up.astype(np.float64), to_cell, 1.0, np.array(point))
        if abs(distance - within_m) > 1e-6:
            assert verdict == (distance <= within_m)


def test_a_steep_slope_explains_what_is_beside_it_not_only_above_it() -> None:
    """At 76 degrees a point 0.9 m beside the slope is 3.6 m above it."""
    grid = ground_grid(hillside(4.0), NORTH_UP)
    beside = np.array([[-0.9, 0.0, 0.0]])
    assert abs(float(grid.up(beside)[0])) > 2.5
    assert grid.explains_points(beside)[0]
    assert not grid.explains_points(np.array([[-2.5, 0.0, 0.0]]))[0]


def test_a_wall_that_is_known_is_explained_up_to_its_top() -> None:
    up = np.zeros((40, 40), np.float32)
    up[:, 20:] = 8.0
    grid = ground_grid(up, NORTH_UP)
    points = np.array([[-0.5, 3.0, 4.0], [-0.5, 3.0, 8.5], [-1.5, 3.0, 4.0], [-0.2, 3.0, 9.5]])
    np.testing.assert_array_equal(grid.explains_points(points), [True, True, False, False])


def test_unknown_cells_and_the_outside_explain_nothing() -> None:
    up = np.zeros((40, 40), np.float32)
    up[:, :20] = np.nan
    grid = ground_grid(up, NORTH_UP)
    points = np.array([[-5.0, 0.0, 0.0], [-0.9, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 15.0, 0.0]])
    np.testing.assert_array_equal(grid.explains_points(points), [False, True, True, False])


@given(st.integers(0, 2**32 - 1), st.floats(0.3, 2.0))
def test_finer_cells_taken_together_lose_no_explanation(seed: int, within_m: float) -> None:
    random = np.random.default_rng(seed)
    up = np.cumsum(random.normal(0, 0.05, (60, 60)), axis=0).astype(np.float32)
    to_cell = np.array([[0.0, -20.0, 30.0], [20.0, 0.0, 30.0]])
    fine, pooled = ground_grid(up, to_cell, cell_m=0.05), ground_grid(up, to_cell, cell_m=0.25)
    assert pooled.up_m.shape == (12, 12)
    points = random.uniform([-2, -2, -2], [2, 2, 3], (60, 3))
    assert not (fine.explains_points(points, within_m) & ~pooled.explains_points(points, within_m)).any()


def test_a_point_that_may_be_nearer_or_farther_is_explained_along_its_line_of_sight() -> None:
    up = np.zeros((40, 40), np.float32)
    up[:, 36:] = 12.0
    grid = ground_grid(up, NORTH_UP)
    point = np.array([[5.0, 0.0, 4.0]])
    for spread, verdict in ((1.0, False), (2.5, True)):
        found = grid.explains_rays((-8.0, 0.0, 4.0), point, np.array([spread]), 1.0)
        assert bool(found[0]) is verdict


@given(st.integers(0, 2**32 - 1))
def test_spread_only_adds_explanations(seed: int) -> None:
    random = np.random.default_rng(seed)
    grid = ground_grid(random.normal(0, 2, (40, 40)).astype(np.float32), NORTH_UP)
    points = random.uniform(-9, 9, (50, 3))
    none = grid.explains_rays((0.0, 0.0, 5.0), points, np.zeros(50), 1.0)
    np.testing.assert_array_equal(none, grid.explains_points(points))
    some = grid.explains_rays((0.0, 0.0, 5.0), points, random.uniform(0, 4, 50), 1.0)
    assert not (none & ~some).any()


@pytest.mark.parametrize("shape", [(0, 4), (4,)])
def test_what_is_no_grid_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="invertible"):
        ground_grid(np.zeros(shape, np.float32), NORTH_UP)
    with pytest.raises(ValueError, match="invertible"):
        ground_grid(np.zeros((4, 4), np.float32), np.zeros((2, 3)))
