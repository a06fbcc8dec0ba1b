"""The certificate's kernels against slow oracles."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import get_num_threads

from planning.certificate.line_heights import height_range
from planning.certificate.nearest import SMALL_MODEL_PX, nearest_distances, threads_for
from planning.certificate.pyramid import LEAF_PX, max_pyramid
from planning.certificate.returns import return_altitude, return_altitudes
from planning.certificate.ways_home import distance_flown, places_along
from tests.reference import clearance as oracle


def rough_terrain(seed: int, *, rows: int, cols: int, holes: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    elevation_m = rng.normal(0.0, 1.5, (rows, cols))
    elevation_m += np.add.outer(3.0 * np.sin(np.arange(rows) / 5.0), 2.0 * np.cos(np.arange(cols) / 7.0))
    elevation_m.ravel()[rng.integers(0, elevation_m.size, holes)] = np.nan
    return elevation_m.astype(np.float32)


def random_segment(
    seed: int, *, width_m: float, height_m: float, margin_m: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    low, high = [-margin_m, -margin_m, -4.0], [width_m + margin_m, height_m + margin_m, 15.0]
    return rng.uniform(low, high), rng.uniform(low, high)


CASES = st.tuples(
    st.integers(0, 2**32 - 1),
    st.integers(1, 30),
    st.integers(1, 30),
    st.sampled_from([0, 0, 3]),
    st.sampled_from([0.3, 1.0]),
)


@settings(max_examples=150, deadline=None)
@given(CASES, st.sampled_from([0.0, 2.0]))
def test_the_distance_of_a_segment_is_exact(case, margin_m):
    seed, rows, cols, holes, res = case
    terrain = rough_terrain(seed, rows=rows, cols=cols, holes=holes)
    start, end = random_segment(seed, width_m=cols * res, height_m=rows * res, margin_m=margin_m)
    distance_m, share = nearest_distances(max_pyramid(terrain, res), start[None], end[None])
    expected_m = oracle.segment_distance(terrain, res, start, end)
    assert distance_m[0] == pytest.approx(expected_m, abs=1e-6)
    at_place = oracle.point_distance(terrain, res, start + share[0] * (end - start))
    assert at_place == pytest.approx(distance_m[0], abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(CASES)
def test_the_distance_is_a_tight_lower_bound_of_dense_samples(case):
    seed, rows, cols, holes, res = case
    terrain = rough_terrain(seed, rows=rows, cols=cols, holes=holes)
    start, end = random_segment(seed, width_m=cols * res, height_m=rows * res)
    distance_m, _ = nearest_distances(max_pyramid(terrain, res), start[None], end[None])
    step_m = float(np.linalg.norm(end - start)) / 100
    sampled_m = oracle.sampled_distance(terrain, res, oracle.sampled_segment(start, end, step_m))
    assert sampled_m - step_m / 2 - 1e-9 <= distance_m[0] <= sampled_m + 1e-9


@settings(max_examples=80, deadline=None)
@given(CASES)
def test_a_point_is_a_segment_without_length(case):
    seed, rows, cols, holes, res = case
    terrain = rough_terrain(seed, rows=rows, cols=cols, holes=holes)
    point, _ = random_segment(seed, width_m=cols * res, height_m=rows * res, margin_m=1.0)
    distance_m, _ = nearest_distances(max_pyramid(terrain, res), point[None], point[None])
    assert distance_m[0] == pytest.approx(oracle.point_distance(terrain, res, point), abs=1e-9)


@settings(max_examples=150, deadline=None)
@given(CASES, st.sampled_from([0.0, 2.0]))
def test_the_heights_above_the_cells_below_are_exact(case, margin_m):
    seed, rows, cols, holes, res = case
    terrain = rough_terrain(seed, rows=rows, cols=cols, holes=holes)
    start, end = random_segment(seed, width_m=cols * res, height_m=rows * res, margin_m=margin_m)
    lowest_m, highest_m = height_range(max_pyramid(terrain, res), start[None], end[None])
    expected = oracle.height_range(terrain, res, start, end)
    assert lowest_m[0] == pytest.approx(expected[0], abs=1e-6)
    if np.isfinite(expected[0]):
        assert highest_m[0] == pytest.approx(expected[1], abs=1e-6)


def test_heights_over_single_cells_are_exact():
    terrain = np.array([[0.0, 1.0, 5.0, 2.0]], dtype=np.float32)
    start, end = np.array([[0.5, 0.5, 10.0]]), np.array([[3.5, 0.5, 7.0]])
    lowest_m, highest_m = height_range(max_pyramid(terrain, 1.0), start, end)
    assert lowest_m[0] == pytest.approx(10.0 - 2.5 - 5.0)  # where the line leaves the third cell
    assert highest_m[0] == pytest.approx(10.0)


def test_a_line_along_a_border_is_judged_against_both_sides():
    terrain = np.zeros((4, 4), dtype=np.float32)
    terrain[:, 1] = 3.0
    start, end = np.array([[2.0, 0.5, 10.0]]), np.array([[2.0, 3.5, 10.0]])
    lowest_m, highest_m = height_range(max_pyramid(terrain, 1.0), start, end)
    assert (lowest_m[0], highest_m[0]) == (7.0, 10.0)


@pytest.mark.parametrize("end_x_m", [-0.01, 4.0, 4.01])
def test_leaving_the_model_is_endless_depth_and_no_distance(end_x_m):
    terrain = np.zeros((4, 4), dtype=np.float32)
    start, end = np.array([[2.0, 2.0, 10.0]]), np.array([[end_x_m, 2.0, 10.0]])
    lowest_m, _ = height_range(max_pyramid(terrain, 1.0), start, end)
    distance_m, _ = nearest_distances(max_pyramid(terrain, 1.0), start, end)
    assert lowest_m[0] == -np.inf
    assert distance_m[0] == 0.0


def test_the_edge_of_the_model_is_a_wall_of_any_height():
    terrain = np.zeros((40, 40), dtype=np.float32)
    start, end = np.array([[20.0, 20.0, 500.0]]), np.array([[37.5, 20.0, 900.0]])
    distance_m, share = nearest_distances(max_pyramid(terrain, 1.0), start, end)
    assert distance_m[0] == pytest.approx(2.5)
    assert share[0] == 1.0


def test_a_mast_of_one_fine_cell_is_found():
    terrain = np.zeros((1200, 900), dtype=np.float32)  # 1 cm cells
    terrain[611, 437] = 8.0
    start, end = np.array([[3.5, 2.0, 6.0]]), np.array([[3.5, 10.0, 6.0]])
    distance_m, share = nearest_distances(max_pyramid(terrain, 0.01), start, end)
    assert distance_m[0] == pytest.approx(0.87, abs=1e-9)
    assert 2.0 + 8.0 * share[0] == pytest.approx(6.115, abs=0.006)


def test_the_edge_wins_over_a_mast_farther_away():
    terrain = np.zeros((100, 100), dtype=np.float32)
    terrain[50, 50] = np.nan
    start, end = np.array([[40.0, 30.0, 90.0]]), np.array([[40.0, 70.0, 90.0]])
    distance_m, _ = nearest_distances(max_pyramid(terrain, 1.0), start, end)
    assert distance_m[0] == pytest.approx(10.0)  # the hole is a column without end


def test_the_pyramid_holds_the_maxima_and_marks_the_unknown():
    terrain = rough_terrain(5, rows=37, cols=21)
    terrain[30, 2] = np.nan
    pyramid = max_pyramid(terrain, 1.0)
    offset, rows, cols = pyramid.layout[0]
    level = pyramid.maxima_m[offset : offset + rows * cols].reshape(rows, cols)
    assert level.shape == (5, 3)
    assert level[1, 1] == terrain[LEAF_PX : 2 * LEAF_PX, LEAF_PX : 2 * LEAF_PX].max()
    assert level[3, 0] == np.inf
    assert np.isfinite(np.delete(level.ravel(), 9)).all()
    assert pyramid.maxima_m[-1] == np.inf


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 1.0, 3.0]), st.sampled_from([0, 0, 2]))
def test_the_return_height_matches_the_oracle(seed, clearance_m, holes):
    """From everywhere on the line, not only from its places."""
    terrain = rough_terrain(seed, rows=23, cols=30, holes=holes)
    rng = np.random.default_rng(seed)
    places = rng.uniform([4.0, 4.0, -3.0], [26.0, 19.0, 12.0], (3, 3))
    home = rng.uniform([4.0, 4.0], [26.0, 19.0])
    needed_m, place = return_altitude(max_pyramid(terrain, 1.0), places, home, clearance_m)
    between = np.vstack([oracle.sampled_segment(a, b, 0.8) for a, b in itertools.pairwise(places)])
    asked = [oracle.return_altitude(terrain, 1.0, p, home, clearance_m, 0.25) for p in between]
    assert max((a for a, p in zip(asked, between, strict=True) if a > p[2]), default=-np.inf) <= needed_m + 1e-9
    if place >= 0:
        wider_m = clearance_m + 0.53  # what lies between two samples is within 0.4 m and 0.125 m of one of them
        piece = oracle.sampled_segment(places[place], places[place + 1], 0.8)
        assert needed_m <= max(oracle.return_altitude(terrain, 1.0, p, home, wider_m, 0.25) for p in piece) + 1e-9


def test_a_mast_between_two_ways_home_is_seen():
    terrain = np.zeros((2000, 2000), dtype=np.float32)  # 1 cm
    terrain[1000, 1024] = 25.0  # 10.24 m east: between the ways home of the first two places
    places, home = np.array([[10.0, 10.5, 5.0], [10.5, 10.5, 5.0]]), np.array([10.25, 1.0])
    pyramid = max_pyramid(terrain, 0.01)
    assert return_altitude(pyramid, places[:1], home, 0.05) == (-np.inf, -1)
    assert return_altitude(pyramid, places[1:], home, 0.05) == (-np.inf, -1)
    assert return_altitude(pyramid, places, home, 0.05) == (pytest.approx(25.05), 0)


def test_a_block_inside_the_swept_triangle_is_seen():
    terrain = np.zeros((40, 40), dtype=np.float32)
    terrain[20, 20] = 9.0
    places, home = np.array([[35.0, 5.0, 3.0], [35.0, 35.0, 3.0]]), np.array([4.0, 20.5])
    assert return_altitude(max_pyramid(terrain, 1.0), places, home, 1.0) == (pytest.approx(10.0), 0)


def test_what_lies_beyond_a_line_straight_to_home_asks_for_nothing():
    terrain = np.zeros((40, 40), dtype=np.float32)
    terrain[10, 35] = 9.0
    home = np.array([4.0, 10.5])
    for jitter_m in (0.0, 1e-12, 1e-10, 1e-7):
        places = np.array([[20.0, 10.5, 3.0], [20.5, 10.5 + jitter_m, 3.0]])
        assert return_altitude(max_pyramid(terrain, 1.0), places, home, 1.0) == (-np.inf, -1)


def test_a_piece_that_is_high_enough_asks_for_nothing():
    terrain = np.zeros((40, 40), dtype=np.float32)
    terrain[20, 20] = 12.0
    places, home = np.array([[9.0, 20.5, 14.5], [9.5, 20.5, 14.5], [10.0, 20.5, 13.9]]), np.array([30.0, 20.5])
    pyramid = max_pyramid(terrain, 1.0)
    assert return_altitude(pyramid, places[:2], home, 2.0) == (-np.inf, -1)
    assert return_altitude(pyramid, places, home, 2.0) == (14.0, 1)


def test_close_to_home_autopilots_climb_less():
    places = np.array([[0.5, 0.0, 4.0], [8.25, 0.0, 4.0], [10.25, 0.0, 4.0], [20.0, 0.0, 4.0], [20.0, 0.0, 70.0]])
    flown_m = return_altitudes(places, np.zeros(2), 1.0, rtl_height_m=31.0, step_m=0.5)
    assert flown_m == pytest.approx([4.0, 9.0, 11.0, 32.0, 70.0])


def test_places_include_every_vertex_and_are_close_enough():
    points = np.array([[0.0, 0.0, 5.0], [3.0, 4.0, 5.0], [3.0, 4.0, 9.0], [3.0, 4.1, 9.0]])
    places, s_m = places_along(points, 1.5)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() <= 1.5
    assert all((places == vertex).all(axis=1).any() for vertex in points)
    assert distance_flown(points) == pytest.approx([0.0, 5.0, 5.0, 5.1])
    assert (np.diff(s_m) >= 0).all()
    assert s_m[-1] == pytest.approx(5.1)


def test_small_models_take_one_thread_and_give_the_others_back():
    before = get_num_threads()
    with threads_for(SMALL_MODEL_PX - 1):
        assert get_num_threads() == 1
    assert get_num_threads() == before
    with threads_for(SMALL_MODEL_PX):
        assert get_num_threads() == before
