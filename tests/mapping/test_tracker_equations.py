"""The tracker's kernels and its assignment beside the paper's equations and a textbook's filter, written slowly."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapping.tracking import cartesian, polar
from mapping.tracking.kalman import distances, spreads, update, variances
from mapping.tracking.tracker import assign
from mapping.tracking.tracker_params import TrackerParams
from tests.reference import gnn, kalman

FOREVER = math.inf
SEEDS = st.integers(0, 2**32 - 1)


def state_of(seed: int):
    """Of an object 3 to 50 m away, any covariance, and a vehicle."""
    random = np.random.default_rng(seed)
    bearing, own = random.uniform(-3.0, 3.0), random.normal(0.0, 3.0, 4)
    away = random.uniform(3.0, 50.0) * np.array([math.sin(bearing), math.cos(bearing)])
    root = random.normal(0.0, 0.5, (4, 4))
    return np.concatenate([own[:2] + away, random.normal(0.0, 4.0, 2)]), root @ root.T + 0.05 * np.eye(4), own


@given(SEEDS, st.floats(0.01, 2.0))
def test_cartesian_prediction(seed, dt_s):
    x, P, _ = state_of(seed)
    ours_x, ours_P = x[None].copy(), P[None].copy()
    cartesian.predict(ours_x, ours_P, dt_s, 1.7)
    theirs_x, theirs_P = kalman.predicted(x, P, dt_s, (1.7, 1.7))
    np.testing.assert_allclose(ours_x[0], theirs_x, rtol=1e-10)
    np.testing.assert_allclose(ours_P[0], theirs_P, rtol=1e-9, atol=1e-12)


@given(st.floats(5.0, 80.0), st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), st.floats(-0.2, 0.2), st.floats(0.01, 0.5))
def test_polar_prediction_is_the_papers_linear_one(range_m, bearing_rad, rate, turn, dt_s):
    x, P = np.array([range_m, bearing_rad, rate, turn]), np.diag([0.3, 0.01, 0.2, 0.1])
    ours_x, ours_P = x[None].copy(), P[None].copy()
    polar.predict(ours_x, ours_P, dt_s, 1.7, np.zeros(2))
    theirs_x, theirs_P = kalman.predicted(x, P, dt_s, (1.7, 1.7 / (range_m + dt_s * rate)))
    np.testing.assert_allclose(np.sin(ours_x[0] - theirs_x), np.zeros(4), atol=1e-12)
    np.testing.assert_allclose(ours_P[0], theirs_P, rtol=1e-9, atol=1e-12)


@given(SEEDS)
def test_what_a_radar_would_measure_and_its_derivatives(seed):
    x, _, own = state_of(seed)
    z, H = cartesian.expected(x[None], own)
    measure = kalman.range_bearing_rate(own)
    np.testing.assert_allclose(z[0], measure(x), rtol=1e-12, atol=1e-12)
    if abs(abs(z[0, 1]) - math.pi) > 1e-3:  # differences across the branch cut are none
        np.testing.assert_allclose(H[0], kalman.derivatives(measure, x), atol=1e-5)


@given(SEEDS, st.booleans())
def test_an_update_and_its_distance_are_a_textbooks(seed, with_rate):
    x, P, own = state_of(seed)
    measure, random = kalman.range_bearing_rate(own), np.random.default_rng(seed)
    R = np.array([[0.1, 0.004, 0.04]])
    z, H = cartesian.expected(x[None], own)
    found = z + random.normal(0.0, 0.1, (1, 3))
    if not with_rate:
        found[0, 2] = math.nan
    off = distances(z, P[None], H, R, found, FOREVER, 1e9)
    ours_x, ours_P = x[None].copy(), P[None].copy()
    update(ours_x, ours_P, z, H, R, found, np.array([0]), np.array([0]), FOREVER)
    rows = 3 if with_rate else 2
    theirs_x, theirs_P = kalman.updated(x, P, found[0, :rows], np.diag(R[0, :rows]), lambda at: measure(at)[:rows])
    np.testing.assert_allclose(ours_x[0], theirs_x, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(ours_P[0], theirs_P, rtol=1e-3, atol=1e-4)
    S = (H[0] @ P @ H[0].T + np.diag(R[0]))[:rows, :rows]
    v = (found - z)[0, :rows]
    v[1] = math.remainder(v[1], 2 * math.pi)
    assert off[0, 0] == pytest.approx(v @ np.linalg.solve(S, v), rel=1e-6)  # eq. 6


@given(SEEDS)
def test_the_spread_is_the_largest_ratio_in_any_direction(seed):
    x, P, own = state_of(seed)
    z, H = cartesian.expected(x[None], own)
    R = variances(z, 0.0, TrackerParams().noise())
    place = H[0, :2] @ P @ H[0, :2].T
    ratios = np.linalg.eigvals(np.linalg.solve(np.diag(R[0, :2]), place)).real
    assert spreads(P[None], H, R)[0] == pytest.approx(ratios.max(), rel=1e-9)


@given(SEEDS, st.sampled_from(["cartesian", "polar"]))
def test_a_first_state_is_where_the_detection_was(seed, coordinates):
    random = np.random.default_rng(seed)
    z = np.array([[random.uniform(1.0, 100.0), random.uniform(-3.0, 3.0), random.normal(0.0, 5.0)]])
    own, R = random.normal(0.0, 5.0, 4), np.array([[0.1, 0.001, 0.04]])
    if coordinates == "polar":
        x, P = polar.to_enu(*polar.begin(z, R, own, 5.0), own)
    else:
        x, P = cartesian.begin(z, R, own, 5.0)
    np.testing.assert_allclose(kalman.range_bearing_rate(own)(x[0]), z[0], rtol=1e-9, atol=1e-9)
    across = np.array([math.cos(z[0, 1]), -math.sin(z[0, 1])])
    assert x[0, 2:] @ across == pytest.approx(0.0, abs=1e-9)
    assert across @ P[0, :2, :2] @ across == pytest.approx(z[0, 0] ** 2 * 0.001, rel=1e-9)
    assert np.linalg.eigvalsh(P[0]).min() > -1e-9


@given(SEEDS)
def test_polar_states_and_cartesian_ones_are_the_same_objects(seed):
    """The covariance goes along by the derivatives of the change of coordinates."""
    random = np.random.default_rng(seed)
    own = random.normal(0.0, 5.0, 4)
    x = np.array([random.uniform(2.0, 50.0), random.uniform(-3.0, 3.0), random.normal(), random.normal(0.0, 0.2)])
    root = random.normal(0.0, 0.1, (4, 4))
    P = root @ root.T
    enu, cov = polar.to_enu(x[None], P[None], own)

    def change(at):
        return polar.to_enu(at[None], P[None], own)[0][0]

    J = kalman.derivatives(change, x)
    np.testing.assert_allclose(cov[0], J @ P @ J.T, rtol=1e-4, atol=1e-5)
    measured = kalman.range_bearing_rate(own)(enu[0])
    assert measured[[0, 2]] == pytest.approx(x[[0, 2]], rel=1e-9, abs=1e-9)
    assert math.remainder(measured[1] - x[1], 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_the_vehicles_own_change_of_velocity_is_taken_out_of_polar_rates():
    """It brakes by 2 m/s: what was coming at 5 m/s comes at 3 m/s, and what was abeam falls behind more slowly."""
    x = np.array([[40.0, 0.0, -5.0, 0.0], [10.0, math.pi / 2, 0.0, 0.5]])
    polar.predict(x, np.zeros((2, 4, 4)), 0.0, 1.0, np.array([0.0, -2.0]))
    assert x[0, 2] == pytest.approx(-3.0)
    assert x[1, 2:] == pytest.approx([0.0, 0.3])


def test_beyond_the_edge_bearings_are_worse():
    params = TrackerParams(bearing_edge_rad=0.35, bearing_sigma_rad=0.035, bearing_edge_sigma_rad=0.14, extent_m=0.0)
    bearing = np.array([0.0, 0.3, -0.3, 0.4, -0.4]) + 6.0
    R = variances(np.column_stack([np.full(5, 8.0), bearing, np.zeros(5)]), 6.0 - 2 * math.pi, params.noise())
    np.testing.assert_allclose(np.sqrt(R[:, 1]), [0.035, 0.035, 0.035, 0.14, 0.14])


@settings(max_examples=150)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 4), st.integers(1, 4)), elements=st.floats(0.0, 20.0)),
    st.floats(1.0, 15.0),
    st.floats(0.3, 0.999),
)
def test_the_assignment_is_the_cheapest_of_eq_4(squares, gate, detection_probability):
    miss_cost = TrackerParams(detection_probability=detection_probability).miss_cost
    chosen, taken = assign(squares, gate=gate, miss_cost=miss_cost)
    assert len(set(taken.tolist())) == len(taken)
    printed = gnn.matrix(squares, gate=gate, detection_probability=detection_probability)
    columns = [squares.shape[1] + i for i in range(len(squares))]
    for i, j in zip(chosen.tolist(), taken.tolist(), strict=True):
        columns[i] = j
    assert gnn.cost(printed, columns) == pytest.approx(gnn.cheapest(printed), abs=1e-9)


def test_with_no_detections_nobody_gets_one():
    chosen, taken = assign(np.empty((3, 0)), gate=9.0, miss_cost=2.0)
    assert len(chosen) == len(taken) == 0


def test_a_radar_of_nine_in_ten_refuses_a_fifth_of_an_objects_own_detections():
    """Why the default probability is not a real radar's: eq. 6 has no constant of the normal density in it."""
    squares = np.random.default_rng(0).chisquare(3, 4_000)[:, None, None]

    def taken(probability: float) -> float:
        params = TrackerParams(detection_probability=probability)
        found = [len(assign(one, gate=params.gate, miss_cost=params.miss_cost)[0]) for one in squares]
        return float(np.mean(found))

    assert taken(0.9) == pytest.approx(0.8, abs=0.03)
    assert taken(TrackerParams().detection_probability) == pytest.approx(0.99, abs=0.01)
