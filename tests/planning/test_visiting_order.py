"""The shortest order of points."""

from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.route.visiting_order import shortest_order

points = st.tuples(st.floats(-100, 100), st.floats(-100, 100))


def length_m(xy: np.ndarray, order: list[int]) -> float:
    return sum(float(np.hypot(*(xy[b] - xy[a]))) for a, b in pairwise(order))


@settings(deadline=None)
@given(st.lists(points, min_size=1, max_size=7))
def test_few_points_are_ordered_exactly(places: list) -> None:
    xy = np.array(places)
    order = shortest_order(xy)
    best = min(length_m(xy, [0, *rest]) for rest in permutations(range(1, len(xy))))
    assert order[0] == 0
    assert sorted(order) == list(range(len(xy)))
    assert length_m(xy, order) == pytest.approx(best)


@settings(deadline=None, max_examples=20)
@given(st.integers(10, 40), st.integers(0, 1000))
def test_many_points_cannot_be_improved_by_reversing_a_stretch(n: int, seed: int) -> None:
    xy = np.random.default_rng(seed).uniform(0, 100, (n, 2))
    order = shortest_order(xy)
    assert order[0] == 0
    assert sorted(order) == list(range(n))
    here = length_m(xy, order)
    for i in range(1, n):
        for j in range(i + 1, n + 1):
            assert length_m(xy, order[:i] + order[i:j][::-1] + order[j:]) >= here - 1e-6


def test_points_on_a_line_are_visited_along_it() -> None:
    shuffled = np.random.default_rng(3).permutation(np.arange(1, 30))
    xy = np.column_stack([np.concatenate([[0], shuffled]), np.zeros(30)])
    assert xy[shortest_order(xy), 0].tolist() == list(range(30))


def test_nothing_to_order() -> None:
    assert shortest_order(np.empty((0, 2))) == []
    assert shortest_order(np.zeros((1, 2))) == [0]
