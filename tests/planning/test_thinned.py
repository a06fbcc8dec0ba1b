"""A timed line with fewer points: nowhere farther from the whole one, at the same time, than is told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.errors import ParameterError
from planning.following.thinned import thinned


def walk(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """With places where it stays, and points that are passed at one time."""
    drawn = np.random.default_rng(seed)
    points_m = np.cumsum(drawn.normal(0.0, 8.0, (count, 3)) * (drawn.random((count, 1)) < 0.8), axis=0)
    stays = drawn.random(count) < 0.2
    points_m[1:][stays[1:]] = points_m[:-1][stays[1:]]
    return points_m, np.cumsum(drawn.exponential(1.0, count))


def at(points_m: np.ndarray, t_s: np.ndarray, when_s: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(when_s, t_s, points_m[:, axis]) for axis in range(3)])


@given(st.integers(0, 10_000), st.integers(2, 60), st.integers(2, 40), st.sampled_from([0.0, 0.5, 10.0]))
def test_no_moment_is_farther_off_than_is_told(seed: int, count: int, most: int, good_enough_m: float) -> None:
    points_m, t_s = walk(seed, count)
    kept, off_m = thinned(points_m, t_s, most=most, good_enough_m=good_enough_m)
    assert (kept[0], kept[-1]) == (0, count - 1)
    assert (np.diff(kept) > 0).all()
    assert len(kept) <= max(2, most)
    when_s = np.concatenate([np.linspace(t_s[0], t_s[-1], 997), t_s])
    true_m = np.linalg.norm(at(points_m, t_s, when_s) - at(points_m[kept], t_s[kept], when_s), axis=1).max()
    assert true_m <= off_m + 1e-9
    # And it is told no worse than it is.
    assert true_m >= off_m - 1e-9
    assert off_m <= good_enough_m or len(kept) == min(most, count)


def test_what_is_straight_and_steady_needs_its_ends_alone_and_a_stay_is_seen() -> None:
    t_s = np.linspace(0.0, 10.0, 50)
    straight_m = np.column_stack([3.0 * t_s, t_s, 0.0 * t_s])
    assert thinned(straight_m, t_s, most=50, good_enough_m=0.01)[0].tolist() == [0, 49]
    stayed_s = np.where(t_s > 5.0, t_s + 60.0, t_s)
    kept, off_m = thinned(straight_m, stayed_s, most=50, good_enough_m=0.01)
    assert len(kept) == 4
    assert off_m <= 0.01
    # What all happens at one moment lies between its ends only by chance.
    jumps_m = np.array([[0.0, 0.0, 0.0], [0.0, 30.0, 0.0], [5.0, 0.0, 0.0]])
    kept, off_m = thinned(jumps_m, np.zeros(3), most=2, good_enough_m=1.0)
    assert (kept.tolist(), off_m) == ([0, 2], 30.0)


@pytest.mark.parametrize(("count", "most", "t_s"), [(1, 5, [0.0]), (3, 1, [0, 1, 2]), (3, 5, [0, 2, 1]), (3, 5, [0])])
def test_what_is_no_line_is_refused(count: int, most: int, t_s: list[float]) -> None:
    with pytest.raises(ParameterError, match="two points"):
        thinned(np.zeros((count, 3)), np.array(t_s, dtype=float), most=most, good_enough_m=1.0)
