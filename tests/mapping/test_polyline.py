"""Lines of straight legs, against places laid densely along them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import Polyline, along_m, length_m

metres = st.floats(-50, 50).map(lambda value: round(value, 2))


@st.composite
def lines(draw: st.DrawFn) -> F64:
    """Two or three dimensions; some points repeat."""
    point = st.tuples(*[metres] * draw(st.sampled_from([2, 3])))
    points = draw(st.lists(point, min_size=2, max_size=6))
    return np.array([p for p in points for _ in range(draw(st.integers(1, 2)))])


def slow_at(points: F64, along: float) -> F64:
    for a, b in itertools.pairwise(points):
        leg_m = math.dist(a, b)
        if along <= leg_m and leg_m > 0:
            return a + max(0.0, along) / leg_m * (b - a)
        along -= leg_m
    return points[-1]


@given(lines(), st.floats(-0.2, 1.2))
def test_places_along_are_found_by_walking_leg_after_leg(points: F64, share: float) -> None:
    line, along = Polyline(points), share * length_m(points)
    np.testing.assert_allclose(line.at(along), slow_at(points, along), atol=1e-6)
    assert (
        line.along_m[-1]
        == pytest.approx(length_m(points))
        == pytest.approx(sum(itertools.starmap(math.dist, itertools.pairwise(points))))
    )
    np.testing.assert_array_equal(along_m(points), line.along_m)


@given(lines(), st.data())
def test_the_nearest_place_is_as_near_as_any_of_many(points: F64, data: st.DataObject) -> None:
    line, place = Polyline(points), np.array([data.draw(metres) for _ in range(points.shape[1])])
    at_m, away_m = line.nearest(place)
    many_m = np.linspace(0.0, line.along_m[-1], 400)
    slow_m = min(math.dist(slow_at(points, along), place) for along in many_m)
    assert away_m <= slow_m + 1e-9
    assert slow_m <= away_m + line.along_m[-1] / 399 + 1e-9
    assert math.dist(line.at(at_m), place) == pytest.approx(away_m, abs=1e-6)


@given(lines(), st.floats(0, 1), st.floats(0, 1))
def test_a_part_is_as_long_as_its_ends_are_apart_along_the_line(points: F64, one: float, other: float) -> None:
    line = Polyline(points)
    from_m, to_m = sorted(share * line.along_m[-1] for share in (one, other))
    part = line.between(from_m, to_m)
    assert length_m(part) == pytest.approx(to_m - from_m, abs=1e-6)
    np.testing.assert_array_equal(line.ahead(from_m, to_m - from_m)[0], part[0])


def test_of_a_line_that_crosses_itself_the_nearest_place_of_the_part_asked_for() -> None:
    line = Polyline([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [5.0, 10.0], [5.0, -5.0]])
    assert line.nearest(np.array([5.0, 0.1])) == (pytest.approx(34.9), pytest.approx(0.0))
    assert line.nearest(np.array([5.0, 0.1]), 0.0, 8.0) == (pytest.approx(5.0), pytest.approx(0.1))


def test_distance_over_ground_is_that_of_the_first_two_columns() -> None:
    points = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 100.0], [3.0, 4.0, 0.0]])
    assert along_m(points[:, :2]).tolist() == [0.0, 5.0, 5.0]
    assert along_m(points[:1]).tolist() == [0.0]
