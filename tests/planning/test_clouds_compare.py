"""A cloud's tops against a surface model: moved as a whole, beside its place, or standing above bare ground."""

from __future__ import annotations

import numpy as np
import pytest
from affine import Affine
from hypothesis import given
from hypothesis import strategies as st
from pyproj import CRS

from mapping.geometry.arrays import F32
from planning.terrain.clouds.compare import Compared, compared, tops_of
from planning.terrain.dsm import Dsm
from planning.terrain.vertical_datum import datums_differ

SIDE = 60


def model(heights: F32, cell_m: float = 1.0) -> Dsm:
    return Dsm(heights, Affine(cell_m, 0.0, 5e5, 0.0, -cell_m, 4.17e6), CRS.from_epsg(32633), None, "")


def ground() -> F32:
    """A slope of 45 degrees with a furrow."""
    rows, columns = np.mgrid[:SIDE, :SIDE]
    return (100.0 + columns + 3.0 * np.sin(rows / 4.0)).astype(np.float32)


def seen(heights: F32, of: F32) -> Compared:
    found = compared(tops_of(model(heights)), 1.0, model(of))
    assert found is not None
    return found


def test_the_model_of_the_cloud_itself_is_not_apart_from_it() -> None:
    found = seen(ground(), ground())
    assert (found.cells, found.above_share) == (SIDE * SIDE, 0.0)
    assert (found.median_m, found.off_m, found.low_m, found.high_m) == (0.0, 0.0, 0.0, 0.0)


@given(trees=st.integers(40, 1500), height_m=st.floats(4.5, 60.0))
def test_trees_above_bare_ground_are_counted_and_no_shift(trees: int, height_m: float) -> None:
    heights = ground().reshape(-1)
    heights[np.random.default_rng(trees).choice(heights.size, trees, replace=False)] += height_m
    found = seen(heights.reshape(SIDE, SIDE), ground())
    assert found.above_share == pytest.approx(trees / SIDE**2)
    assert found.low_m == 0.0
    assert found.median_m == 0.0
    assert height_m - 2.5 <= found.above_m <= height_m + 1e-3


@given(st.floats(-80.0, 80.0))
def test_a_shift_of_all_is_told_in_all_cells(shift_m: float) -> None:
    found = seen(ground() + np.float32(shift_m), ground())
    assert found.low_m == pytest.approx(shift_m, abs=1e-4)
    assert found.high_m == pytest.approx(shift_m, abs=1e-4)


def test_finer_cells_of_the_model_are_all_looked_at() -> None:
    fine = np.repeat(np.repeat(ground(), 10, axis=0), 10, axis=1)
    found = compared(tops_of(model(ground())), 1.0, model(fine, 0.1))
    assert found is not None
    assert (found.above_share, found.off_m) == (0.0, 0.0)


def test_nothing_is_compared_where_nothing_is_known() -> None:
    assert compared(tops_of(model(ground())), 1.0, model(np.full((SIDE, SIDE), np.nan, np.float32))) is None
    assert compared(np.array([[np.inf, np.nan, 1.0]]), 1.0, model(ground())) is None


@pytest.mark.parametrize(
    ("one", "other", "differ"),
    [
        ("NAVD88 height (ftUS)", "NAVD88", False),
        ("EGM96 height", "EGM96 geoid", False),
        ("WGS 84 ellipsoid", "ellipsoidal height", False),
        ("EGM96 height", None, False),
        (None, None, False),
        ("EGM96 height", "NAVD88 height", True),
        ("EGM96 height", "EGM2008 height", True),
        ("ellipsoid", "EGM96 height", True),
        ("site datum A", "site datum B", True),
    ],
)
def test_datums_differ_where_both_are_named_and_are_not_one(one: str | None, other: str | None, differ: bool) -> None:
    assert datums_differ(one, other) is differ
