"""Simple polygons and the lines through them."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mapping.geometry.polygons import area_m2, crossing_edges, extents

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
U_SHAPE = np.array([[0, 0], [9, 0], [9, 6], [6, 6], [6, 2], [3, 2], [3, 6], [0, 6]], dtype=np.float64)
BOW_TIE = np.array([[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]])


def test_areas() -> None:
    assert area_m2(SQUARE) == 12
    assert area_m2(SQUARE[::-1]) == 12
    assert area_m2(U_SHAPE) == 42


@pytest.mark.parametrize("simple", [SQUARE, U_SHAPE, SQUARE[:3]])
def test_simple_polygons_are_found_simple(simple: np.ndarray) -> None:
    assert crossing_edges(simple) is None


def test_crossing_and_touching_edges_are_found() -> None:
    assert crossing_edges(BOW_TIE) == (0, 2)
    pinched = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]])
    assert crossing_edges(pinched) is not None


def test_a_strip_through_a_concave_polygon_has_two_parts() -> None:
    assert extents(U_SHAPE, 3.0, 5.0) == [(0, 3), (6, 9)]
    assert extents(U_SHAPE, 1.0, 3.0) == [(0, 9)]
    assert extents(U_SHAPE, 7.0, 8.0) == []


def test_a_strip_reaches_as_far_as_the_polygon_does_in_it() -> None:
    triangle = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    assert extents(triangle, 2.0, 4.0) == [(0, 8)]
    assert extents(triangle, -1.0, 11.0) == [(0, 10)]


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=3, max_size=9))
def test_narrow_strips_add_up_to_the_area(points: list) -> None:
    star = np.array(points)
    star = star[np.argsort(np.arctan2(*(star - star.mean(axis=0)).T[::-1]))]
    assume(area_m2(star) > 50 and crossing_edges(star) is None)
    borders = np.linspace(star[:, 1].min(), star[:, 1].max(), 201)
    swept = sum(b - a for y0, y1 in pairwise(borders) for a, b in extents(star, y0, y1)) * (borders[1] - borders[0])
    sideways = np.abs(np.diff(np.vstack([star, star[:1]])[:, 0])).sum() * (borders[1] - borders[0])
    assert area_m2(star) * (1 - 1e-9) <= swept <= area_m2(star) + sideways * (1 + 1e-6)
