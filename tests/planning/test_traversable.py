"""A surface model's map at the wanted resolution, and a radar log in degrees laid over it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from mapping.errors import CapacityError
from mapping.uwb.uwb_params import UwbGeometry
from planning.errors import ParameterError
from planning.ground import traversable
from planning.ground.traversable import UwbScans, cleared_ground, sites_near, traversable_ground
from planning.terrain.dsm import Dsm

GEOMETRY = UwbGeometry(bins=40)


def lawn(cell_m: float = 0.2, cells: int = 150, *, east_m: float = 700_000.0) -> Dsm:
    """30 m square with one bush 6 m north of its middle, away from the zone's central meridian."""
    elevation_m = np.full((cells, cells), 100.0, np.float32)
    elevation_m[int(9 / cell_m), int(15 / cell_m)] = 101.0
    corner = Affine.translation(east_m, 5_400_030.0) @ Affine.scale(cell_m, -cell_m)
    return Dsm(elevation_m, corner, CRS.from_epsg(32633), None, "")


def scans_from(dsm: Dsm, towards_bush: float) -> UwbScans:
    """30 scans to the south, then 40 from the middle of the grid at the bush, their poses from true north."""
    west, south, *_ = dsm.bounds_m
    xy_m = np.repeat([[west + 15.1, south + 15.0]], 70, axis=0)
    here, there = dsm.lat_lon_from_xy(np.array([xy_m[0], xy_m[0] + [0, 100.0]]))
    true_rad = math.atan2((there[1] - here[1]) * math.cos(math.radians(here[0])), there[0] - here[0])
    heading_rad = np.where(np.arange(70) < 30, math.pi, towards_bush) + true_rad
    random = np.random.default_rng(0)
    intensity = 30 + random.normal(0, 2, (70, 40)) - np.where(np.arange(70) >= 30, 2.0, 0.0)[:, None]
    return UwbScans(np.arange(70) / 10, dsm.lat_lon_from_xy(xy_m), heading_rad, intensity, GEOMETRY)


def test_fine_models_are_taken_together_and_masts_survive() -> None:
    dsm = lawn(0.05, 600)
    ground = traversable_ground(dsm)
    assert ground.dsm.resolution_m == pytest.approx(0.3)
    assert ground.map.index.shape == ground.dsm.elevation_m.shape == (100, 100)
    assert ground.map.untraversable.sum() == 9
    assert traversable_ground(dsm, 0.1).map.index.shape == (300, 300)
    coarse = replace(dsm, transform=Affine.translation(0, 0) @ Affine.scale(1.0, -1.0))
    assert traversable_ground(coarse).dsm is coarse


def test_a_few_known_heights_do_not_make_a_cell_known() -> None:
    dsm = lawn(0.05, 600)
    sparse = np.full_like(dsm.elevation_m, np.nan)
    sparse[::6, ::6] = 100.0
    ground = traversable_ground(dsm.with_elevation(sparse))
    assert np.isnan(ground.dsm.elevation_m).all()
    assert not ground.map.known.any()
    ((lat_deg, lon_deg),) = dsm.lat_lon_from_xy(np.array([[700_015.0, 5_400_015.0]])).tolist()
    assert "unknown" in sites_near(ground, (lat_deg, lon_deg), 0.5, 8.0).no_site


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 6), st.floats(0.2, 0.9))
def test_cells_are_known_where_most_of_the_model_below_them_is(seed: int, together: int, share: float) -> None:
    random = np.random.default_rng(seed)
    heights_m = random.normal(100, 1, random.integers(7, 30, 2)).astype(np.float32)
    heights_m[random.random(heights_m.shape) > share] = np.nan
    dsm = lawn(0.1, 200).with_elevation(heights_m)
    grid_m = traversable_ground(dsm, 0.1 * together).dsm.elevation_m
    for (row, col), height_m in np.ndenumerate(grid_m):
        block = heights_m[row * together :, col * together :][:together, :together]
        if together > 1 and np.isfinite(block).mean() < 0.6:
            assert np.isnan(height_m)
        else:
            np.testing.assert_equal(height_m, np.nanmax(block) if np.isfinite(block).any() else np.nan)


def test_large_models_come_coarser_unless_a_resolution_is_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(traversable, "MOST_CELLS", 2000)
    assert traversable_ground(lawn()).map.index.size <= 2000
    monkeypatch.setattr("mapping.traversability.MOST_CELLS", 2000)
    with pytest.raises(CapacityError, match="more than the 2,000"):
        traversable_ground(lawn(), 0.2)
    with pytest.raises(ParameterError):
        traversable_ground(lawn(), -1.0)


def test_headings_count_from_true_north_and_the_grid_is_turned() -> None:
    dsm = lawn()
    ground = traversable_ground(dsm)
    blocked = ground.map.untraversable
    found = cleared_ground(ground, scans_from(dsm, 0.0))
    assert found.cleared.sum() > 0
    assert found.seen[blocked].all()
    beside = cleared_ground(ground, scans_from(dsm, math.radians(30)))
    assert not beside.cleared.any()
    assert beside.time_in_view_s[blocked].max() == 0.0


def test_a_log_of_another_place_is_refused() -> None:
    dsm = lawn()
    far = replace(scans_from(dsm, 0.0), lat_lon_deg=np.repeat([[10.0, 20.0]], 70, axis=0))
    with pytest.raises(ParameterError, match="never enters the surface model"):
        cleared_ground(traversable_ground(dsm), far)
