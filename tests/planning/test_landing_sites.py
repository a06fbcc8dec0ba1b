"""Landing sites: far from obstacles, level, apart, with their reasons; and why there is none."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.traversability import Traversability, traversability_map
from planning.errors import ParameterError
from planning.ground.landing_sites import FARTHEST_OBSTACLE_M, LandingParams, landing_sites
from planning.ground.traversable import site_places, sites_near, traversable_ground
from planning.terrain.geotiff import read_dsm

CELL_M = 0.5


def yard(seed: int = 0, size: int = 80) -> Traversability:
    """Lawn with posts and a few holes in the model."""
    random = np.random.default_rng(seed)
    elevation_m = random.normal(0, 0.005, (size, size))
    for row, col in random.integers(0, size, (6, 2)):
        elevation_m[row, col] = 2.0
    elevation_m[random.integers(0, size), random.integers(0, size)] = np.nan
    return traversability_map(elevation_m.astype(np.float32), CELL_M)


def nearest_obstacle_m(found: Traversability, row: int, col: int) -> float:
    """To the rim of the nearest blocked or unknown cell, or of the map."""
    rows, cols = np.nonzero(found.untraversable | ~found.known)
    down = np.maximum(np.abs(rows - row) - 0.5, 0) * CELL_M
    right = np.maximum(np.abs(cols - col) - 0.5, 0) * CELL_M
    edge = (min(row, col, found.index.shape[0] - 1 - row, found.index.shape[1] - 1 - col) + 0.5) * CELL_M
    return min(float(np.hypot(down, right).min(initial=math.inf)), edge)


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.floats(0.3, 2.0), st.floats(0, 80), st.floats(0, 80), st.floats(5, 60))
def test_sites_keep_all_promises(seed: int, span_m: float, row: float, col: float, radius_m: float) -> None:
    ground = yard(seed)
    found = landing_sites(ground, (row, col), span_m, radius_m)
    params = LandingParams()
    assert bool(found.sites) is not bool(found.no_site)
    assert [site.rank for site in found.sites] == list(range(1, len(found.sites) + 1))
    for site in found.sites:
        true_m = nearest_obstacle_m(ground, site.row, site.col)
        assert 2 * span_m <= site.obstacle_distance_m <= true_m + 1e-6
        assert site.distance_m == pytest.approx(math.hypot(site.row + 0.5 - row, site.col + 0.5 - col) * CELL_M)
        assert site.distance_m <= radius_m
        assert site.slope_rad <= params.steepest_rad
        assert site.roughness_m <= params.roughest_m
    places = [(site.row, site.col) for site in found.sites]
    for k, one in enumerate(places):
        assert all(math.dist(one, other) * CELL_M >= max(5.0, 4 * span_m) - 1e-6 for other in places[:k])


def test_five_sites_with_reasons_in_words() -> None:
    found = landing_sites(yard(), (40.0, 40.0), 0.8, 30.0)
    assert len(found.sites) == 5
    reasons = found.sites[0].reasons
    assert reasons[0].startswith("Slope ")
    assert any("m from the nearest obstacle (1.6 m needed)" in reason for reason in reasons)
    assert any("from the point" in reason for reason in reasons)


def test_far_from_everything_is_said_as_such() -> None:
    flat = traversability_map(np.zeros((200, 200), np.float32), CELL_M)
    (first, *_) = landing_sites(flat, (100.0, 100.0), 0.8, 5.0).sites
    assert (first.row, first.col) in {(99, 99), (99, 100), (100, 99), (100, 100)}
    assert first.obstacle_distance_m == FARTHEST_OBSTACLE_M
    assert "No obstacle within 30 m" in first.reasons


def test_a_level_place_is_better_than_a_steep_one() -> None:
    elevation_m = np.zeros((100, 100), np.float32)
    elevation_m[:, :50] = np.arange(50)[::-1] * CELL_M * math.tan(math.radians(8))
    found = landing_sites(traversability_map(elevation_m, CELL_M), (50.0, 45.0), 0.5, 20.0)
    assert found.sites[0].col > 50
    assert all(site.slope_rad <= math.radians(10) for site in found.sites)


@pytest.mark.parametrize(
    ("elevation_m", "words"),
    [
        (np.full((60, 60), np.nan), "unknown"),
        (np.random.default_rng(1).normal(0, 0.5, (60, 60)), "two rotor spans"),
        (np.mgrid[:60, :60][0] * CELL_M * math.tan(math.radians(25)), "too steep: 25.0 deg"),
        (np.indices((60, 60)).sum(axis=0) % 2 * 0.12, "rougher than 5 cm"),
    ],
    ids=["unknown", "strewn", "steep", "rough"],
)
def test_why_there_is_none(elevation_m: np.ndarray, words: str) -> None:
    found = landing_sites(traversability_map(elevation_m.astype(np.float32), CELL_M), (30.0, 30.0), 0.8, 20.0)
    assert found.sites == ()
    assert words in found.no_site


def roof(height_m: float) -> np.ndarray:
    """30 m square on a lawn of 60 m, 0.5 m cells; as uneven as photogrammetry is."""
    random = np.random.default_rng(0)
    elevation_m = random.normal(0, 0.01, (120, 120))
    elevation_m[30:90, 30:90] += height_m
    return elevation_m.astype(np.float32)


@pytest.mark.parametrize("height_m", [12.0, 3.0, 1.5], ids=["roof", "maize", "hedge"])
def test_roofs_and_crowns_are_not_landed_on(height_m: float) -> None:
    ground = traversability_map(roof(height_m), CELL_M)
    above = landing_sites(ground, (60.0, 60.0), 0.8, 12.0)
    assert above.sites == ()
    assert "roofs, hedges and tree tops" in above.no_site
    beside = landing_sites(ground, (60.0, 60.0), 0.8, 40.0)
    assert len(beside.sites) == 5
    assert all(ground.elevation_m[site.row, site.col] < 0.1 for site in beside.sites)


def test_a_pit_with_steep_walls_and_a_plateau_with_a_ramp_are_ground() -> None:
    assert len(landing_sites(traversability_map(roof(-3.0), CELL_M), (60.0, 60.0), 0.8, 10.0).sites) > 0
    plateau = roof(3.0)
    plateau[55:65, 90:114] = np.linspace(3.0, 0.0, 24)
    found = landing_sites(traversability_map(plateau, CELL_M), (60.0, 60.0), 0.8, 10.0)
    assert len(found.sites) > 0
    assert all(plateau[site.row, site.col] > 2.9 for site in found.sites)


def test_off_the_map_there_is_no_site_and_nonsense_is_refused() -> None:
    assert "no landing site" in landing_sites(yard(), (5000.0, -400.0), 0.8, 20.0).no_site
    for near, span_m, radius_m in (((math.inf, 0.0), 0.8, 20.0), ((1.0, 1.0), 0.0, 20.0), ((1.0, 1.0), 0.8, math.nan)):
        with pytest.raises(ParameterError):
            landing_sites(yard(), near, span_m, radius_m)


def test_a_park_has_sites_and_steep_bush_has_none(shared_data: Path) -> None:
    for name, expected in (("brighton/brighton_dsm_020.tif", 5), ("coromandel/coromandel_dsm_050.tif", 0)):
        dsm = read_dsm(shared_data / "dsm" / name)
        ground = traversable_ground(dsm)
        west, south, east, north = dsm.bounds_m
        (middle,) = dsm.lat_lon_from_xy(np.array([[(west + east) / 2, (south + north) / 2]])).tolist()
        found = sites_near(ground, (middle[0], middle[1]), 0.8, 60.0)
        assert len(found.sites) == expected
        places = site_places(ground, found)
        assert places.shape == (expected, 3)
        np.testing.assert_allclose(
            ground.dsm.elevation_at(ground.dsm.xy_from_lat_lon(places[:, :2])), places[:, 2], atol=0.01
        )
