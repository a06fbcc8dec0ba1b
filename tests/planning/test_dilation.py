"""`planning.safe_surface`: the kernels behind eq. 2 of Melita 2020."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

from planning.safe_surface.element import ball, coarsest_block, finest_block, work
from planning.safe_surface.kernel import dilate_grid
from planning.safe_surface.smooth import gaussian_grid
from tests.reference.dilation import dilate_slowly

HEIGHTS = st.one_of(st.just(np.nan), st.floats(-400, 4000, width=32))
GRIDS = hnp.arrays(np.float32, hnp.array_shapes(min_dims=2, max_dims=2, max_side=18), elements=HEIGHTS)
RADII = st.floats(0.3, 9).map(lambda radius_px: round(radius_px, 6))
"""The kernel takes a cell that is farther by a rounding error along; eq. 2 does not."""
BALL_HEIGHTS = st.floats(0.1, 20)


def dilated(grid, radius_px, height_m):
    element = ball(radius_px=radius_px, height_m=height_m)
    return dilate_grid(np.ascontiguousarray(grid), element.weights_m, element.pairs)


@given(GRIDS, RADII, BALL_HEIGHTS)
@settings(deadline=None, max_examples=60)
def test_dilation_is_eq_2(grid, radius_px, height_m):
    slow = dilate_slowly(grid, radius_px=radius_px, height_m=height_m)
    fast = dilated(grid, radius_px, height_m)
    np.testing.assert_allclose(fast, slow, rtol=6.1e-8, atol=2e-6)


@given(GRIDS, RADII, BALL_HEIGHTS, st.floats(1, 2), st.floats(1, 2))
@settings(deadline=None, max_examples=60)
def test_dilation_grows_with_radius_and_height(grid, radius_px, height_m, more_r, more_h):
    low = dilated(grid, radius_px, height_m)
    for high in (dilated(grid, radius_px * more_r, height_m), dilated(grid, radius_px, height_m * more_h)):
        assert np.all(np.nan_to_num(high, nan=-999) >= np.nan_to_num(low, nan=-999))


@given(GRIDS, RADII, BALL_HEIGHTS)
@settings(deadline=None, max_examples=60)
def test_every_known_cell_is_cleared_by_the_full_height(grid, radius_px, height_m):
    above = dilated(grid, radius_px, height_m) - grid.astype(float)
    assert np.all(above[~np.isnan(grid)] >= height_m - 1e-3)


@given(GRIDS, RADII, st.integers(0, 5), st.integers(0, 5))
@settings(deadline=None, max_examples=60)
def test_dilation_moves_with_the_ground(grid, radius_px, down, right):
    rows, cols = grid.shape
    moved = np.full((rows + down, cols + right), np.nan, np.float32)
    moved[down:, right:] = grid
    np.testing.assert_array_equal(dilated(moved, radius_px, 3.0)[down:, right:], dilated(grid, radius_px, 3.0))


def test_tiles_leave_no_seam():
    rng = np.random.default_rng(3)
    grid = rng.standard_normal((131, 2100)).astype(np.float32)
    whole = dilated(grid, 7.5, 2.0)
    for col in (900, 1010):
        part = dilated(grid[:, col : col + 100], 7.5, 2.0)
        np.testing.assert_array_equal(whole[:, col + 8 : col + 92], part[:, 8:92])


def test_a_radius_that_is_whole_on_paper_reaches_its_rim():
    grid = np.full((7, 7), np.nan, np.float32)
    grid[3, 3] = 1
    assert dilated(grid, 0.3 / 0.1, 5.0)[3, 0] == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(("radius_px", "block_px"), [(20, 1), (56, 1), (57, 2), (200, 4), (1587, 28)])
def test_coarsest_block_uses_the_allowed_excess(radius_px, block_px):
    assert coarsest_block(radius_px) == block_px
    assert 2 * np.sqrt(2) * (block_px - 1) < 0.05 * radius_px


def test_finest_block_spends_what_it_may():
    shape = (2048, 2048)
    assert finest_block(shape, 20, 1e10) == 1
    assert finest_block(shape, 200, 0) == 4
    assert work(shape, 200, finest_block(shape, 200, 1e10)) <= 1e10


@given(st.floats(57, 3000), st.floats(0.5, 50))
@settings(deadline=None, max_examples=30)
def test_block_element_lies_between_the_balls(radius_px, height_m):
    """Every pair of cells a block weight stands for: at least the ball, at most the ball enlarged by 5 %."""
    block_px = coarsest_block(radius_px)
    element = ball(radius_px=radius_px, height_m=height_m, block_px=block_px)
    offsets = np.arange(element.weights_m.shape[0]) * block_px
    for dy, dx in ((0, 0), (block_px - 1, 1 - block_px), (1 - block_px, 1 - block_px), (block_px - 1, block_px - 1)):
        true_px = np.hypot(np.abs(offsets + dy)[:, None], np.abs(offsets + dx)[None, :])
        weight = element.weights_m[:, : offsets.size].astype(float)
        exact = height_m * np.sqrt(1 - (true_px / radius_px) ** 2, where=true_px <= radius_px, out=0 * true_px)
        assert np.all((weight >= exact - 1e-4) | (true_px > radius_px))
        inside = weight > -1e29
        assert np.all(true_px[inside] <= 1.05 * radius_px)
        grown = 1.05 * height_m * np.sqrt(1 - (true_px[inside] / (1.05 * radius_px)) ** 2)
        assert np.all(weight[inside] <= grown)


@given(GRIDS, st.floats(0.3, 6))
@settings(deadline=None, max_examples=60)
def test_smoothing_is_a_mean_of_known_cells_only(grid, sigma_px):
    known = ~np.isnan(grid)
    smooth = gaussian_grid(grid, sigma_px)
    assert np.array_equal(np.isnan(smooth), ~known)
    blur = {"sigma": sigma_px, "mode": "constant", "radius": int(np.ceil(4 * sigma_px))}
    total = ndimage.gaussian_filter(np.where(known, grid, 0).astype(float), **blur)
    weight = ndimage.gaussian_filter(known.astype(float), **blur)
    np.testing.assert_allclose(smooth[known], (total[known] / weight[known]), rtol=1e-5, atol=2e-2)


def test_smoothing_leaves_a_plane_a_plane():
    plane = np.full((30, 40), 2500.0, np.float32)
    np.testing.assert_array_equal(gaussian_grid(plane, 4.0), plane)
    np.testing.assert_array_equal(gaussian_grid(plane, 0.0), plane)
