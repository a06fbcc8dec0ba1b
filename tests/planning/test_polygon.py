"""Simple polygons and the lines through them."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planning.polygon import area_m2, chords, crossing_edges

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


def test_a_line_through_a_concave_polygon_has_two_parts() -> None:
    assert chords(U_SHAPE, 4.0) == [(0, 3), (6, 9)]
    assert chords(U_SHAPE, 1.0) == [(0, 9)]
    assert chords(U_SHAPE, 7.0) == []


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=3, max_size=9))
def test_chords_add_up_to_the_area(points: list) -> None:
    star = np.array(points)
    star = star[np.argsort(np.arctan2(*(star - star.mean(axis=0)).T[::-1]))]
    assume(area_m2(star) > 50 and crossing_edges(star) is None)
    low, high = star[:, 1].min(), star[:, 1].max()
    rows = low + (np.arange(2000) + 0.5) / 2000 * (high - low)
    swept = sum(b - a for y in rows for a, b in chords(star, float(y))) * (high - low) / 2000
    assert swept == pytest.approx(area_m2(star), rel=0.01)
