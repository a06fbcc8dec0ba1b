"""Slope, roughness and index against a general solver, and what they say of simple ground."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping import traversability
from mapping.errors import CapacityError, ParameterError
from mapping.traversability import TraversabilityParams, traversability_map
from planning.terrain.geotiff import read_dsm
from tests.reference.traversability import patch_plane


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, 0.3, 1.0]), st.sampled_from([0.0, 800.0]))
def test_against_the_general_solver(seed: int, resolution_m: float, height_m: float) -> None:
    random = np.random.default_rng(seed)
    elevation_m = (height_m + random.normal(0, 0.3, (9, 11))).astype(np.float32)
    elevation_m[random.random(elevation_m.shape) < 0.1] = np.nan
    found = traversability_map(elevation_m, resolution_m)
    half = 2 if resolution_m == 0.1 else 1
    assert found.known.sum() > 40
    for row, col in np.argwhere(found.known):
        slope_rad, roughness_m = patch_plane(elevation_m, int(row), int(col), half, resolution_m)
        assert found.slope_rad[row, col] == pytest.approx(slope_rad, abs=1e-4)
        assert found.roughness_m[row, col] == pytest.approx(roughness_m, abs=1e-4)


@settings(max_examples=30)
@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-500, 3000))
def test_a_plane_is_as_steep_as_it_is_and_not_rough(east: float, north: float, height_m: float) -> None:
    rows, cols = np.mgrid[:12, :15] * 0.2
    found = traversability_map((height_m + east * cols - north * rows).astype(np.float32), 0.2)
    np.testing.assert_allclose(found.slope_rad, math.atan(math.hypot(east, north)), atol=2e-3)
    assert found.roughness_m.max() < 1e-3


def test_a_step_blocks_and_a_ripple_does_not() -> None:
    elevation_m = np.zeros((40, 40), np.float32)
    elevation_m[20:, :20] = 0.25
    elevation_m[20:, 20:] = 0.03
    found = traversability_map(elevation_m, 0.1)
    assert found.untraversable[19:21, :18].all()
    assert not found.untraversable[:, 23:].any()
    assert not found.untraversable[:17].any()
    assert found.value.max() == 1.0
    np.testing.assert_allclose(found.value[:, 23:], found.index[:, 23:] / 40)


def test_unknown_ground_is_neither_open_nor_blocked() -> None:
    elevation_m = np.zeros((20, 20), np.float32)
    elevation_m[5:15, 5:15] = np.nan
    elevation_m[10, 10] = 3.0
    found = traversability_map(elevation_m, 0.3)
    assert not found.known[5:15, 5:15].any()
    assert not found.untraversable.any()
    assert np.isnan(found.value[10, 10])
    assert found.known[0, 0]


def test_the_weights_decide_what_counts() -> None:
    rows = np.mgrid[:10, :10][0] * np.float32(0.5)
    steep = traversability_map(rows, 0.5, TraversabilityParams(slope_weight=2.0, roughness_weight=0.0))
    np.testing.assert_allclose(steep.index, 90.0, atol=1e-3)


def test_what_makes_no_sense_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    flat = np.zeros((10, 10), np.float32)
    for elevation_m, resolution_m, params in (
        (np.zeros(5, np.float32), 0.3, None),
        (np.zeros((0, 5), np.float32), 0.3, None),
        (flat, 0.0, None),
        (flat, math.nan, None),
        (flat, 0.3, TraversabilityParams(patch_m=-1)),
        (flat, 0.3, TraversabilityParams(known_share=0.0)),
    ):
        with pytest.raises(ParameterError):
            traversability_map(elevation_m, resolution_m, params)
    monkeypatch.setattr(traversability, "MOST_CELLS", 25)
    with pytest.raises(CapacityError, match=r"0\.6 m or a smaller area"):
        traversability_map(flat, 0.3)


def test_trees_and_walls_of_a_real_place_block_and_its_lawn_does_not(shared_data: Path) -> None:
    dsm = read_dsm(shared_data / "dsm" / "brighton" / "brighton_dsm_020.tif")
    found = traversability_map(dsm.elevation_m, dsm.resolution_m)
    assert 0.02 < found.untraversable.sum() / found.known.sum() < 0.1
    assert np.median(np.rad2deg(found.slope_rad[found.known])) < 10
    assert np.isnan(found.index[~found.known]).all()
