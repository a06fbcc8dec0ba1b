"""Neighbours among radar targets, against every pair of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.perceiving.radar_near import cells, columns, stronger_aside, weighted

WITHIN_M = 1.5


def targets(seed: int, count: int, spread_m: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Some on a raster of quarters, so that distances are met exactly."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 1, (count, 3)) * (*spread_m, 1.0)
    points[::2] = np.round(points[::2] * 4) / 4
    return points, rng.choice([0.5, 1.0], count)


@given(st.integers(0, 2**32 - 1), st.integers(0, 40), st.integers(0, 40), st.sampled_from([(3, 3), (0, 9), (9, 0.5)]))
def test_the_heaviest_near_each_point(seed: int, count: int, others: int, spread_m: tuple[float, float]) -> None:
    points, _ = targets(seed, count, spread_m)
    seen, weight = targets(seed + 1, others, spread_m)
    near = np.sum((points[:, None, :2] - seen[None, :, :2]) ** 2, axis=2) <= WITHIN_M**2
    expected = np.max(np.where(near, weight, 0.0), axis=1, initial=0.0)
    np.testing.assert_array_equal(weighted(seen, weight).heaviest_near(points, WITHIN_M), expected)


@given(st.integers(0, 2**32 - 1), st.integers(0, 60))
def test_what_has_a_stronger_one_aside_at_its_range(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    range_m, sine = rng.integers(8, 60, count) / 4.0, rng.integers(-7, 8, count) / 10.0
    snr_db = rng.integers(0, 8, count).astype(np.float64)
    same = np.abs(range_m[:, None] - range_m) <= 1.5
    aside = np.abs(np.abs(sine[:, None] - sine) - 0.35) <= 0.07
    stronger = snr_db > snr_db[:, None] + 2.0
    found = stronger_aside(range_m, sine, snr_db, within_m=1.5, aside=0.35, width=0.07, by_db=2.0)
    np.testing.assert_array_equal(found, np.any(same & aside & stronger, axis=1))


@given(st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), max_size=8), st.sampled_from([0.25, 1.0, 3.0]))
def test_cells_are_those_that_hold_the_points(points: list[tuple[float, float, float]], edge_m: float) -> None:
    table = np.array(points).reshape(-1, 3)
    assert list(zip(*cells(table, edge_m), strict=True)) == [tuple(math.floor(v / edge_m) for v in p) for p in points]
    assert columns(table) == [(math.floor(e), math.floor(n)) for e, n, _ in points]


def test_nothing_is_near_nothing() -> None:
    assert weighted(np.empty((0, 3)), np.empty(0)).heaviest_near(np.ones((2, 3)), 1.0).tolist() == [0.0, 0.0]
    assert columns(np.empty((0, 3))) == []
    assert weighted(np.zeros((1, 3)), np.ones(1)).heaviest_near(np.zeros((1, 3)), 0.0) == pytest.approx([1.0])
