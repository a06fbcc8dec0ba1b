"""`planning.safe_surface.surface`: from the surface model to the safe surface."""

import math

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS
from scipy import ndimage

from planning.basics.plan_model import SurfaceParams
from planning.errors import ParameterError
from planning.safe_surface.surface import block_max, dilate, safe_surface, safe_surface_at
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from tests.reference.dilation import ball_structure, dilate_fast

UTM = CRS.from_epsg(32633)


def make_dsm(elevation_m, resolution_m=1.0):
    transform = Affine(resolution_m, 0, 500_000.0, 0, -resolution_m, 4_180_000.0)
    return Dsm(np.asarray(elevation_m, np.float32), transform, UTM, None, "0" * 64)


def rough(rows, cols, *, relief_m=30.0, base_m=100.0, unknown=0.0, seed=1):
    rng = np.random.default_rng(seed)
    heights = base_m + relief_m * ndimage.gaussian_filter(rng.standard_normal((rows, cols)), 5)
    heights += (rng.random((rows, cols)) > 0.995) * relief_m
    heights[rng.random((rows, cols)) < unknown] = np.nan
    return make_dsm(heights)


def cell_centres(dsm):
    r, c = np.mgrid[: dsm.height_px, : dsm.width_px] + 0.5
    west, _, _, north = dsm.bounds_m
    return np.column_stack([west + c.ravel() * dsm.resolution_m, north - r.ravel() * dsm.resolution_m])


def test_block_max_keeps_a_mast_and_the_map_position():
    heights = np.zeros((10, 7), np.float32)
    heights[9, 6] = 40
    heights[:3, :3] = np.nan
    heights[4, 1] = np.nan
    dsm = make_dsm(heights, 0.5)
    coarse = block_max(dsm, 3)
    assert coarse.elevation_m.shape == (4, 3)
    assert coarse.elevation_m[3, 2] == 40
    assert np.isnan(coarse.elevation_m[0, 0])
    assert coarse.elevation_m[1, 0] == 0
    assert coarse.resolution_m == 1.5
    assert coarse.bounds_m[0] == dsm.bounds_m[0]
    assert coarse.bounds_m[3] == dsm.bounds_m[3]
    np.testing.assert_array_equal(coarse.elevation_at(cell_centres(dsm)[-1:]), [40])


@given(rows=st.integers(1, 40), cols=st.integers(1, 40), factor=st.integers(1, 9), seed=st.integers(0, 99))
@settings(deadline=None, max_examples=40)
def test_block_max_is_the_maximum_of_each_block(rows, cols, factor, seed):
    rng = np.random.default_rng(seed)
    heights = (rng.standard_normal((rows, cols)) * 100).astype(np.float32)
    heights[rng.random((rows, cols)) < 0.6] = np.nan
    padded = np.full((-(-rows // factor) * factor, -(-cols // factor) * factor), -np.inf)
    padded[:rows, :cols] = np.where(np.isnan(heights), -np.inf, heights)
    blocks = padded.reshape(padded.shape[0] // factor, factor, -1, factor).max(axis=(1, 3))
    expected = np.where(np.isinf(blocks), np.nan, blocks)
    np.testing.assert_array_equal(block_max(make_dsm(heights), factor).elevation_m, expected)


def test_block_max_takes_no_factor_below_one():
    with pytest.raises(ParameterError, match="factor is 0"):
        block_max(make_dsm(np.zeros((4, 4))), 0)


@pytest.mark.parametrize("radius_px", [1.0, 3.3, 20.0, 27.9])
@pytest.mark.parametrize("base_m", [-20.0, 800.0, 3300.0])
def test_dilate_equals_scipy(radius_px, base_m):
    dsm = rough(150, 1100, base_m=base_m)
    footprint, structure = ball_structure(radius_px, 5.0)
    expected = ndimage.grey_dilation(
        dsm.elevation_m, footprint=footprint, structure=structure, mode="constant", cval=-np.inf
    )
    got = dilate(dsm, radius_m=radius_px, height_m=5.0).elevation_m
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-4)


def test_a_mast_of_one_cell_survives_every_step():
    heights = np.zeros((600, 600), np.float32)
    heights[301, 299] = 60
    dsm = make_dsm(heights)
    mast = cell_centres(dsm)[301 * 600 + 299][None]
    assert dilate(dsm, radius_m=100.0, height_m=25.0).elevation_at(mast) == 85
    assert dilate_fast(dsm, radius_m=100.0, height_m=25.0).elevation_at(mast) >= 85
    assert dilate(block_max(dsm, 7), radius_m=100.0, height_m=25.0, block_px=2).elevation_at(mast) >= 85


@pytest.mark.parametrize("method", ["exact", "fast", "auto"])
def test_a_mast_of_one_cell_stands_under_the_safe_surface(method):
    heights = np.zeros((400, 400), np.float32)
    heights[201, 199] = 60
    dsm = make_dsm(heights)
    surfaces = safe_surface(dsm, SurfaceParams(radius_m=100.0, height_m=25.0, method=method))
    assert safe_surface_at(surfaces, cell_centres(dsm)[201 * 400 + 199][None]) >= 80


FAST_CASES = [
    ((400, 500), 57.0, 5.0, 100.0, 0.0),
    ((401, 333), 113.7, 40.0, -300.0, 0.3),
    ((357, 390), 200.0, 5.0, 3200.0, 0.98),
]


@pytest.mark.parametrize(("shape", "radius_m", "height_m", "base_m", "unknown"), FAST_CASES)
def test_fast_form_lies_between_its_bounds(shape, radius_m, height_m, base_m, unknown):
    dsm = rough(*shape, base_m=base_m, unknown=unknown)
    fast = dilate_fast(dsm, radius_m=radius_m, height_m=height_m).elevation_m
    low = dilate(dsm, radius_m=radius_m, height_m=height_m).elevation_m
    high = dilate(dsm, radius_m=1.05 * radius_m, height_m=1.05 * height_m).elevation_m
    assert not np.array_equal(fast, low)
    assert not (np.isnan(fast) & ~np.isnan(low)).any()
    assert not (~np.isnan(fast) & np.isnan(high)).any()
    assert np.nanmin(fast - low) >= 0
    assert np.nanmin(high - fast) >= 0


def test_fast_form_of_a_single_known_cell_lies_between_its_bounds():
    heights = np.full((480, 475), np.nan, np.float32)
    heights[233, 241] = -12.5
    dsm = make_dsm(heights)
    fast = dilate_fast(dsm, radius_m=180.0, height_m=45.0).elevation_m
    low = dilate(dsm, radius_m=180.0, height_m=45.0).elevation_m
    high = dilate(dsm, radius_m=189.0, height_m=47.25).elevation_m
    assert np.all(np.nan_to_num(fast, nan=-99) >= np.nan_to_num(low, nan=-99))
    assert np.all(np.nan_to_num(high, nan=-99) >= np.nan_to_num(fast, nan=-99))


def test_fast_form_is_exact_where_no_block_is_fine_enough():
    dsm = rough(80, 90)
    fast = dilate_fast(dsm, radius_m=20.0, height_m=5.0)
    np.testing.assert_array_equal(fast.elevation_m, dilate(dsm, radius_m=20.0, height_m=5.0).elevation_m)


@pytest.mark.parametrize("value", [0.0, -3.0, math.nan, math.inf])
def test_radius_and_height_must_make_sense(value):
    dsm = rough(40, 40)
    with pytest.raises(ParameterError, match=rf"radius is {value:g} m"):
        safe_surface(dsm, SurfaceParams(radius_m=value, height_m=5.0))
    with pytest.raises(ParameterError, match=rf"height is {value:g} m"):
        safe_surface(dsm, SurfaceParams(radius_m=5.0, height_m=value))


def test_radius_must_fit_the_model_and_sigma_must_make_sense():
    dsm = rough(40, 60)
    with pytest.raises(ParameterError, match=r"41 m is larger than the surface model's shorter side, 40 m"):
        safe_surface(dsm, SurfaceParams(radius_m=41.0, height_m=5.0))
    with pytest.raises(ParameterError, match="sigma is -1 m"):
        safe_surface(dsm, SurfaceParams(radius_m=10.0, smooth_sigma_m=-1.0))


@given(
    radius_m=st.floats(1.5, 30),
    height_m=st.floats(0.5, 20),
    sigma_m=st.floats(0, 12),
    method=st.sampled_from(["exact", "fast", "auto"]),
    unknown=st.sampled_from([0.0, 0.3]),
    seed=st.integers(0, 999),
)
@settings(deadline=None, max_examples=40)
def test_safe_surface_stays_above_the_floor_everywhere(radius_m, height_m, sigma_m, method, unknown, seed):
    dsm = rough(70, 60, unknown=unknown, seed=seed)
    params = SurfaceParams(radius_m, height_m, sigma_m, fill_hole_area_m2=0.0, method=method)
    surfaces = safe_surface(dsm, params)
    floor = dilate(dsm, radius_m=radius_m, height_m=0.8 * height_m)
    xy = cell_centres(dsm) + np.random.default_rng(seed).uniform(-0.49, 0.49, (70 * 60, 2))
    at = safe_surface_at(surfaces, xy)
    assert np.array_equal(np.isnan(at), np.isnan(floor.elevation_m.ravel()))
    assert np.nanmin(at - floor.elevation_m.ravel(), initial=0.0) >= 0
    assert surfaces.floor is not None
    assert np.nanmin(surfaces.safe.elevation_m - surfaces.floor.elevation_m, initial=0.0) >= 0


def test_without_the_floor_the_surface_is_the_papers_pipeline():
    dsm = rough(90, 80)
    params = SurfaceParams(radius_m=10.0, height_m=2.5, smooth_sigma_m=3.0, floor=False)
    surfaces = safe_surface(dsm, params)
    dilated = dilate(dsm, radius_m=10.0, height_m=2.5).elevation_m.astype(float)
    inside = slice(13, -13)
    expected = ndimage.gaussian_filter(dilated, 3.0, truncate=4.0)
    np.testing.assert_allclose(surfaces.safe.elevation_m[inside, inside], expected[inside, inside], atol=1e-3)
    assert surfaces.floor is None
    with_floor = safe_surface(dsm, SurfaceParams(radius_m=10.0, height_m=2.5, smooth_sigma_m=3.0))
    assert (with_floor.safe.elevation_m > surfaces.safe.elevation_m).any()


@pytest.mark.parametrize("method", ["exact", "auto"])
def test_a_window_gives_what_the_whole_model_gives(method):
    dsm = rough(220, 300, unknown=0.05)
    params = SurfaceParams(radius_m=12.0, height_m=3.0, method=method)
    path = dsm_points(dsm, [(100.3, 90.0), (140.0, 180.7), (120.0, 130.0)])
    part, whole = safe_surface(dsm, params, around_xy_m=path), safe_surface(dsm, params)
    assert part.safe.width_px < 110
    np.testing.assert_allclose(safe_surface_at(part, path), safe_surface_at(whole, path), atol=1e-4)


def test_a_window_in_blocks_keeps_the_floor():
    dsm = rough(500, 520)
    params = SurfaceParams(radius_m=150.0, height_m=30.0, method="fast")
    rng = np.random.default_rng(5)
    path = dsm_points(dsm, rng.uniform([10, 400], [90, 519.9], (300, 2)))
    part = safe_surface(dsm, params, around_xy_m=path)
    assert part.method == "fast"
    assert part.safe.resolution_m > dsm.resolution_m
    at = safe_surface_at(part, path)
    assert np.all(at >= dilate(dsm, radius_m=150.0, height_m=24.0).elevation_at(path))
    assert np.all(at <= dilate(dsm, radius_m=157.5, height_m=31.5).elevation_m.max())


def dsm_points(dsm, row_col):
    west, _, _, north = dsm.bounds_m
    rc = np.asarray(row_col, float)
    return np.column_stack([west + rc[:, 1] * dsm.resolution_m, north - rc[:, 0] * dsm.resolution_m])


def test_points_off_the_model_are_refused():
    dsm = rough(60, 60)
    with pytest.raises(ParameterError, match="None of the points"):
        safe_surface(dsm, SurfaceParams(radius_m=5.0), around_xy_m=np.array([[0.0, 0.0]]))


def test_filled_holes_are_under_the_surface():
    heights = np.zeros((50, 50), np.float32)
    heights[20, 20] = np.nan
    heights[20, 21] = 30
    filled, holes = fill_holes(make_dsm(heights))
    surfaces = safe_surface(filled, SurfaceParams(radius_m=3.0, height_m=1.0, smooth_sigma_m=0.0))
    assert (holes.count, holes.area_m2) == (1, 1.0)
    assert surfaces.safe.elevation_m[20, 20] == 31


def test_points_on_unknown_ground_have_no_height():
    heights = np.full((40, 40), np.nan, np.float32)
    heights[:, :10] = 7
    dsm = make_dsm(heights)
    surfaces = safe_surface(dsm, SurfaceParams(radius_m=4.0, height_m=1.0))
    at = safe_surface_at(surfaces, dsm_points(dsm, [(20.5, 5.5), (20.5, 13.9), (20.5, 14.5), (-3.0, 5.0)]))
    np.testing.assert_array_equal(np.isnan(at), [False, False, True, True])


def test_real_terrain_keeps_its_height(shared_data):
    rasterio = pytest.importorskip("rasterio")
    path = next((shared_data / "dsm" / "coromandel").glob("*.tif"))
    with rasterio.open(path) as source:
        heights = source.read(1, masked=True).filled(np.nan).astype(np.float32)
        dsm = Dsm(heights, source.transform, CRS.from_user_input(source.crs.to_wkt()), None, "0" * 64)
    surfaces = safe_surface(dsm, SurfaceParams())
    above = surfaces.safe.elevation_m - dsm.elevation_m
    assert np.nanmin(above) >= 4.0 - 1e-4
