"""`planning.terrain.holes`: small holes take the maximum of their rim."""

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS
from skimage.measure import label

from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes

UTM = CRS.from_epsg(32633)


def make_dsm(elevation_m, resolution_m=1.0):
    transform = Affine(resolution_m, 0, 500_000.0, 0, -resolution_m, 4_180_000.0)
    return Dsm(np.array(elevation_m, np.float32), transform, UTM, None, "0" * 64)


def fill_slowly(elevation_m, max_cells):
    """Holes by scikit-image's labels; returns filled heights, count, cells."""
    filled, count, cells = elevation_m.copy(), 0, 0
    holes = np.asarray(label(np.isnan(elevation_m), connectivity=2))
    for k in range(1, holes.max() + 1):
        r, c = np.nonzero(holes == k)
        at_edge = r.min() == 0 or c.min() == 0 or r.max() == len(holes) - 1 or c.max() == holes.shape[1] - 1
        if at_edge or r.size >= max_cells:
            continue
        rim = [elevation_m[y - 1 : y + 2, x - 1 : x + 2] for y, x in zip(r, c, strict=True)]
        filled[r, c] = np.nanmax(rim)
        count, cells = count + 1, cells + r.size
    return filled, count, cells


@given(
    shape=st.tuples(st.integers(1, 30), st.integers(1, 30)),
    unknown=st.floats(0, 1),
    max_area_m2=st.sampled_from([0.0, 1.0, 1.5, 4.0, 9.0, 50.0]),
    seed=st.integers(0, 9999),
)
@settings(deadline=None, max_examples=150)
def test_holes_are_those_scikit_image_finds(shape, unknown, max_area_m2, seed):
    rng = np.random.default_rng(seed)
    heights = rng.standard_normal(shape).astype(np.float32)
    heights[rng.random(shape) < unknown] = np.nan
    filled, report = fill_holes(make_dsm(heights), max_area_m2)
    expected, count, cells = fill_slowly(heights, max_area_m2)
    np.testing.assert_array_equal(filled.elevation_m, expected)
    assert (report.count, report.area_m2) == (count, cells)


def test_area_is_counted_in_square_metres_and_the_limit_is_left_out():
    heights = np.zeros((40, 40), np.float32)
    heights[10:12, 10:12] = np.nan
    heights[20:24, 20:24] = np.nan
    heights[19, 19] = 8
    dsm = make_dsm(heights, 0.5)
    filled, report = fill_holes(dsm, 4.0)
    assert (report.count, report.area_m2) == (1, 1.0)
    assert np.isnan(filled.elevation_m[20:24, 20:24]).all()
    filled, report = fill_holes(dsm, 4.01)
    assert (report.count, report.area_m2) == (2, 5.0)
    assert (filled.elevation_m[20:24, 20:24] == 8).all()


@pytest.mark.parametrize("resolution_m", [0.1, 0.2])
def test_the_limit_is_left_out_at_resolutions_binary_cannot_hold(resolution_m):
    side = round(2 / resolution_m)
    heights = np.zeros((30, 30), np.float32)
    heights[5 : 5 + side, 5 : 5 + side] = np.nan
    assert fill_holes(make_dsm(heights, resolution_m))[1].count == 0


def test_a_model_without_holes_is_returned_as_it_is():
    dsm = make_dsm(np.zeros((5, 5)))
    filled, report = fill_holes(dsm)
    assert filled is dsm
    assert report.count == 0


def test_windows_with_gaps_between_rows_are_read_rightly():
    heights = np.arange(400, dtype=np.float32).reshape(20, 20)
    heights[10, 10] = np.nan
    part, report = fill_holes(make_dsm(heights).window(5, 5, 10, 10))
    assert report.count == 1
    assert part.elevation_m[5, 5] == 231
