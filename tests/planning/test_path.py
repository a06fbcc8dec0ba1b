"""Sampling along segments and the path over a surface."""

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.basics.plan_model import PathParams
from planning.errors import ParameterError, PoiError
from planning.route.path import sample_segments, sampled_path
from planning.route.slopes import slope_limits
from planning.terrain.dsm import Dsm

coordinate = st.floats(-300, 300).map(lambda v: round(v, 2))


def hill(unknown: slice | None = None) -> Dsm:
    row, col = np.mgrid[0:80, 0:120]
    elevation = (10 * np.exp(-((row - 40) ** 2 + (col - 60) ** 2) / 60)).astype(np.float32)
    if unknown is not None:
        elevation[:, unknown] = np.nan
    return Dsm(elevation, Affine(1, 0, 500_000, 0, -1, 5_000_080), CRS.from_epsg(32633), None, "0")


CORNERS = np.array([[500_010.0, 5_000_040.0], [500_110.0, 5_000_040.0], [500_110.0, 5_000_010.03]])


@settings(deadline=None)
@given(st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=6), st.floats(0.05, 3.0))
def test_samples_lie_on_the_segments_no_further_apart_than_the_step(corners: list, step_m: float) -> None:
    points = np.array(corners)
    if np.hypot(*np.diff(points, axis=0).T).min() < 0.01:
        with pytest.raises(PoiError):
            sample_segments(points, step_m)
        return
    xy, s, vertex = sample_segments(points, step_m)
    np.testing.assert_array_equal(xy[vertex], points)
    gaps = np.diff(s)
    assert gaps.min() > 0
    assert gaps.max() <= step_m * (1 + 1e-5)
    np.testing.assert_allclose(np.hypot(*np.diff(xy, axis=0).T), gaps, atol=1e-9)
    assert s[-1] == pytest.approx(np.hypot(*np.diff(points, axis=0).T).sum())


def test_a_segment_of_whole_steps_has_no_sliver_at_its_end() -> None:
    _, s, vertex = sample_segments(np.array([[0.0, 0.0], [0.7, 0.0]]), 0.1)
    assert vertex.tolist() == [0, 7]
    np.testing.assert_allclose(s, np.arange(8, dtype=np.float64) * 0.1, atol=1e-12)


def test_a_hundred_thousand_samples() -> None:
    xy, s, vertex = sample_segments(np.array([[0.0, 0.0], [0.0, 10_000.0]]), 0.1)
    assert len(xy) == len(s) == 100_001 == vertex[-1] + 1


@pytest.mark.parametrize("step_m", [0.0, -1.0, np.nan, 1e-9])
def test_a_useless_step_is_refused(step_m: float) -> None:
    with pytest.raises(ParameterError):
        sample_segments(CORNERS, step_m)


def test_one_point_is_no_path() -> None:
    with pytest.raises(PoiError, match="two points"):
        sample_segments(CORNERS[:1], 0.1)


def test_the_path_is_on_or_above_the_surface_and_within_the_slopes() -> None:
    dsm, params = hill(), PathParams()
    path = sampled_path(dsm, dsm.elevation_at, CORNERS, (None, 0, 1), params)
    climb, descent = slope_limits(params)
    slopes = np.diff(path.alt_dsm_m) / np.diff(path.s_m)
    assert np.all(path.alt_dsm_m >= path.surface_alt_dsm_m)
    assert slopes.max() <= climb + 1e-9
    assert slopes.min() >= -descent - 1e-9
    assert path.alt_dsm_m.max() == pytest.approx(10, abs=0.1)
    assert path.vertex_poi == (None, 0, 1)
    np.testing.assert_array_equal(path.ground_alt_dsm_m, dsm.elevation_at(path.xy_m))


def test_slow_mode_keeps_to_the_surface() -> None:
    dsm = hill()
    path = sampled_path(dsm, dsm.elevation_at, CORNERS, (0, 1, 2), PathParams(on_steep="slow"))
    np.testing.assert_array_equal(path.alt_dsm_m, path.surface_alt_dsm_m)


def test_heights_may_be_given_instead_of_a_function() -> None:
    dsm = hill()
    xy, _, _ = sample_segments(CORNERS, 0.1)
    given_m = sampled_path(dsm, dsm.elevation_at(xy), CORNERS, (0, 1, 2), PathParams())
    asked = sampled_path(dsm, dsm.elevation_at, CORNERS, (0, 1, 2), PathParams())
    np.testing.assert_array_equal(given_m.alt_dsm_m, asked.alt_dsm_m)
    with pytest.raises(ParameterError):
        sampled_path(dsm, np.zeros(3), CORNERS, (0, 1, 2), PathParams())


def test_unknown_surface_is_named_with_its_place() -> None:
    dsm = hill(unknown=slice(50, 60))
    with pytest.raises(PoiError) as error:
        sampled_path(dsm, dsm.elevation_at, CORNERS, (None, 0, 1), PathParams())
    assert "40.0 m along" in error.value.what
    assert error.value.where.startswith("between home and point 1, at 45.15")
    assert error.value.advice


def test_each_vertex_needs_its_index() -> None:
    dsm = hill()
    with pytest.raises(ParameterError):
        sampled_path(dsm, dsm.elevation_at, CORNERS, (0, 1), PathParams())
