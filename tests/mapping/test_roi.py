"""The region of interest: its points, how it is moved, what is found in it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mapping.errors import CapacityError, ParameterError
from mapping.perceiving.roi import search_sector, sector_points, to_enu
from mapping.voxels.map import VoxelMap
from tests.reference.sector import sector

FOV_RAD = math.radians(24.0)
TABLE_1 = {7: 81, 10: 139, 20: 443, 30: 915, 50: 2_361, 70: 4_477, 90: 7_261, 120: 12_699}


@pytest.mark.parametrize(("depth_m", "count"), TABLE_1.items())
def test_counts_of_table_1(depth_m: float, count: int) -> None:
    assert sector_points(depth_m=depth_m, fov_rad=FOV_RAD, height_m=0.9, resolution_m=0.5).shape == (count, 3)


@given(st.floats(1.0, 12.0), st.floats(0.05, 6.2), st.floats(0.0, 5.0), st.sampled_from([0.25, 0.5, 1.0]))
def test_as_eq_a1_written_slowly_nearest_ring_first(depth_m: float, fov_rad: float, height_m: float, mr: float) -> None:
    points = sector_points(depth_m=depth_m, fov_rad=fov_rad, height_m=height_m, resolution_m=mr)
    expected = np.array(sector(depth_m, fov_rad, height_m, mr))
    order = [np.lexsort(np.round(part, 9).T) for part in (points, expected)]
    np.testing.assert_allclose(points[order[0]], expected[order[1]], atol=1e-12)
    rings = np.hypot(points[:, 0], points[:, 1])
    assert np.all(np.diff(rings) > -1e-9)


def test_the_region_turns_clockwise_from_north_with_the_heading() -> None:
    ahead = [[0.0, 10.0, 1.0], [1.0, 0.0, 0.0]]
    np.testing.assert_allclose(to_enu(ahead, (100.0, 200.0, 30.0), 0.0), [[100, 210, 31], [101, 200, 30]])
    np.testing.assert_allclose(to_enu(ahead, (100.0, 200.0, 30.0), math.pi / 2), [[110, 200, 31], [100, 199, 30]])


def test_what_is_found_is_occupied_and_unexplained_nearest_first() -> None:
    voxels = VoxelMap(resolution_m=0.5, memory_limit_bytes=4_000_000)
    points = sector_points(depth_m=20.0, fov_rad=FOV_RAD, height_m=0.9, resolution_m=0.5)
    here, heading_rad = (12.3, -7.7, 40.2), math.radians(130.0)
    at_enu = to_enu(points, here, heading_rad)
    voxels.insert_hits(at_enu[[300, 40]])
    voxels.insert_hits(at_enu[[200]], explained=[True])
    found = search_sector(voxels, points, here, heading_rad)
    assert {40, 300} <= set(found.tolist())
    assert np.all(np.diff(found) > 0)
    assert np.all(voxels.probability(at_enu[found]) > 0.5)
    assert not voxels.explained(at_enu[found]).any()
    with_ground = search_sector(voxels, points, here, heading_rad, include_explained=True)
    assert set(with_ground.tolist()) >= {40, 200, 300}
    np.testing.assert_array_equal(found, search_sector(voxels, at_enu, (0.0, 0.0, 0.0), 0.0))


@given(st.integers(0, 10_000), st.floats(-50.0, 50.0), st.floats(-7.0, 7.0))
@example(16, 0.0, 1.0)
def test_the_fused_search_is_the_plain_one(seed: int, east_m: float, heading_rad: float) -> None:
    rng = np.random.default_rng(seed)
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=4_000_000)
    here = np.array([east_m, 3.3, -8.1])
    voxels.insert(
        here + rng.normal(0.0, 6.0, (300, 3)), origin_enu=here, max_range_m=30.0, explained=rng.random(300) > 0.6
    )
    points = sector_points(depth_m=10.0, fov_rad=2.0, height_m=3.0, resolution_m=0.5)
    at_enu = to_enu(points, here, heading_rad)
    wanted = (voxels.probability(at_enu) > 0.5) & ~voxels.explained(at_enu)
    found = search_sector(voxels, points, here, heading_rad)
    # Points on a border of voxels may round either way, and headings lay whole rows of them there.
    differ = at_enu[np.setxor1d(found, np.flatnonzero(wanted))]
    assert np.all(np.abs(differ - np.round(differ)).min(axis=1, initial=1.0) < 1e-9)


def test_nothing_is_found_in_an_empty_map() -> None:
    voxels = VoxelMap(resolution_m=0.5, memory_limit_bytes=4_000_000)
    points = sector_points(depth_m=7.0, fov_rad=FOV_RAD, height_m=2.0, resolution_m=0.5)
    assert search_sector(voxels, points, (0.0, 0.0, 0.0), 0.0).size == 0
    assert search_sector(voxels, np.full((2, 3), np.nan), (0.0, 0.0, 0.0), 0.0).size == 0


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"depth_m": 0.0}, "depth_m: 0.0"),
        ({"depth_m": math.nan}, "depth_m: nan"),
        ({"fov_rad": 7.0}, "fov_rad: 7 rad is more than a full turn"),
        ({"height_m": -1.0}, "height_m: -1.0"),
        ({"resolution_m": 0.0}, "resolution_m: 0.0"),
    ],
)
def test_regions_that_make_no_sense_are_refused(changed: dict[str, float], said: str) -> None:
    options = {"depth_m": 10.0, "fov_rad": FOV_RAD, "height_m": 1.0, "resolution_m": 0.5} | changed
    with pytest.raises(ParameterError, match=said):
        sector_points(**options)


@pytest.mark.parametrize("resolution_m", [0.01, 1e-9])
def test_a_region_of_too_many_points_is_refused_with_the_number(resolution_m: float) -> None:
    with pytest.raises(CapacityError, match=r"has [\d,]{9,} (points|rings)"):
        sector_points(depth_m=120.0, fov_rad=FOV_RAD, height_m=2.0, resolution_m=resolution_m)


def test_a_vehicle_without_a_place_is_refused() -> None:
    with pytest.raises(ParameterError, match="heading nan"):
        search_sector(VoxelMap(resolution_m=0.5), np.zeros((1, 3)), (0.0, 0.0, 0.0), math.nan)
