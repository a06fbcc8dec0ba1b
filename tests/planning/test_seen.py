"""Seen voxels as part of the surface model, and the first place where a line meets them."""

from __future__ import annotations

import numpy as np
import pytest
from affine import Affine
from hypothesis import given
from hypothesis import strategies as st
from pyproj import CRS

from mapping.geometry.frames import LocalFrame
from planning.certificate.nearest import nearest_distances
from planning.certificate.pyramid import max_pyramid
from planning.evading.seen import Columns, Conflict, burn, columns_from_voxels, conflicts
from planning.terrain.dsm import Dsm
from tests.reference.box_distance import polyline_boxes_m

WEST_M, NORTH_M = 500_000.0, 4_100_000.0
LINE = np.array([[0.0, 0.0, 10.0], [0.0, 60.0, 10.0], [40.0, 60.0, 20.0]])


def flat(*, side: int = 40, resolution_m: float = 0.5, height_m: float = 100.0) -> Dsm:
    elevation_m = np.full((side, side), height_m, np.float32)
    grid = Affine(resolution_m, 0, WEST_M, 0, -resolution_m, NORTH_M)
    return Dsm(elevation_m, grid, CRS.from_epsg(32633), "EGM96 height", "")


def test_cells_under_a_column_rise_to_its_top_and_half_a_voxel_more() -> None:
    dsm = flat()
    columns = Columns(np.array([[WEST_M + 10.0, NORTH_M - 10.0]]), np.array([107.0]), 1.0)
    burnt = burn(dsm, columns)
    raised = np.argwhere(burnt.elevation_m > 100.0)
    assert (burnt.elevation_m[burnt.elevation_m > 100.0] == 107.5).all()
    assert raised.min(axis=0).tolist() == [18, 18]
    assert raised.max(axis=0).tolist() == [21, 21]  # a metre to either side of the middle: the voxel and half of one
    assert (dsm.elevation_m == 100.0).all()
    assert burnt.crs == dsm.crs


def test_lower_columns_unknown_cells_and_columns_outside_change_nothing() -> None:
    dsm = flat()
    holed = dsm.elevation_m.copy()
    holed[18:22, 18:22] = np.nan
    dsm = dsm.with_elevation(holed)
    xy_m = np.array([[WEST_M + 10.0, NORTH_M - 10.0], [WEST_M + 5, NORTH_M - 5], [WEST_M - 50, NORTH_M], [np.nan, 0.0]])
    burnt = burn(dsm, Columns(xy_m, np.array([107.0, 90.0, 120.0, 120.0]), 1.0))
    assert np.array_equal(burnt.elevation_m, dsm.elevation_m, equal_nan=True)


@given(
    places=st.lists(st.tuples(st.floats(-3, 23), st.floats(-3, 23), st.floats(90, 130)), min_size=1, max_size=20),
    edge_m=st.sampled_from([0.3, 0.5, 1.0, 2.0]),
)
def test_a_burnt_model_is_nowhere_lower_than_the_model_or_a_voxel(
    places: list[tuple[float, float, float]], edge_m: float
) -> None:
    dsm = flat()
    found = np.array(places)
    xy_m = found[:, :2] * [1, -1] + [WEST_M, NORTH_M]
    burnt = burn(dsm, Columns(xy_m, found[:, 2], edge_m))
    assert (burnt.elevation_m >= dsm.elevation_m).all()
    for (x, y), top_m in zip(xy_m, found[:, 2], strict=True):
        corners = np.array([[x + i * edge_m / 2, y + j * edge_m / 2] for i in (-1, 0, 1) for j in (-1, 0, 1)])
        under = burnt.elevation_at(corners)
        assert (under[np.isfinite(under)] >= top_m + edge_m / 2).all()


def test_voxels_of_a_map_are_placed_in_the_surface_models_reference_system() -> None:
    dsm = flat(side=400)
    lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[WEST_M + 100.0, NORTH_M - 100.0]]))[0]
    frame = LocalFrame(float(lat_deg), float(lon_deg), 140.0)
    columns = columns_from_voxels([[3.0, -4.0, 6.5]], 1.0, frame=frame, dsm=dsm, home_alt_dsm_m=100.0)
    assert columns.xy_m[0] == pytest.approx([WEST_M + 103.0, NORTH_M - 104.0], abs=0.02)
    assert columns.top_alt_dsm_m[0] == pytest.approx(107.0)
    assert columns.edge_m == 1.0


def test_the_first_conflict_along_the_line_is_found_with_its_leg() -> None:
    voxels = np.array([[0.4, 50.5, 10.5], [0.5, 30.5, 11.5], [0.5, 31.5, 11.5], [20.5, 60.5, 15.5], [9.0, 20.0, 10.0]])
    found = conflicts(LINE, voxels, resolution_m=1.0, radius_m=1.5)
    assert found == Conflict(30.0, 0, 1.0, (0.5, 30.5, 11.5), 2)
    later = conflicts(LINE[1:], voxels, resolution_m=1.0, radius_m=0.6)
    assert later is not None
    assert (later.leg, later.voxels) == (0, 1)
    assert later.ahead_m == pytest.approx(20 * np.hypot(1, 0.25), abs=1.1)


def test_without_a_voxel_or_a_line_there_is_no_conflict() -> None:
    assert conflicts(LINE, np.empty((0, 3)), resolution_m=1.0, radius_m=1.0) is None
    assert conflicts(LINE[:1], np.zeros((1, 3)), resolution_m=1.0, radius_m=1.0) is None
    assert conflicts(LINE, np.array([[500.0, 0.0, 0.0], [0.0, 30.0, 40.0]]), resolution_m=1.0, radius_m=1.0) is None


@given(seed=st.integers(0, 10_000), radius_m=st.floats(0.3, 4.0))
def test_conflicts_are_those_that_every_voxel_against_every_leg_finds(seed: int, radius_m: float) -> None:
    rng = np.random.default_rng(seed)
    line = np.cumsum(rng.uniform([-15, -15, -3], [15, 15, 3], (5, 3)), axis=0)
    voxels = np.floor(rng.uniform([-40, -40, -10], [40, 40, 10], (40, 3))) + 0.5
    found = conflicts(line, voxels, resolution_m=1.0, radius_m=radius_m)
    apart_m = [polyline_boxes_m(line, voxel[None], 0.5) for voxel in voxels]
    if found is None:
        assert min(apart_m) >= radius_m - 1e-9
        return
    assert min(apart_m) < radius_m + 0.06
    leg = line[found.leg : found.leg + 2]
    assert polyline_boxes_m(leg, np.array([found.enu_m]), 0.5) == pytest.approx(found.distance_m, abs=0.06)
    before = polyline_boxes_m(line[: found.leg + 1], voxels, 0.5) if found.leg else np.inf
    assert before >= radius_m - 1e-9


def test_the_distance_to_a_burnt_model_counts_what_was_seen() -> None:
    dsm = flat()
    burnt = burn(dsm, Columns(np.array([[WEST_M + 10.0, NORTH_M - 10.0]]), np.array([107.0]), 1.0))
    above = np.array([[10.0, 10.0, 110.0]])
    apart_m, _ = nearest_distances(max_pyramid(burnt.elevation_m, burnt.resolution_m), above, above)
    assert apart_m[0] == pytest.approx(2.5)
