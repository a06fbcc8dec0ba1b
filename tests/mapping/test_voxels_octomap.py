"""Occupancy maps of recorded scans against OctoMap itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mapping.geometry.arrays import F64
from mapping.voxels.map import VoxelMap
from tests.mapping.clouds import car_clouds, gicp_clouds, seen_by_camera
from tests.reference.octomap import octree
from tests.reference.octomap_bt import read_bt

Keys = NDArray[np.int64]
"""Each voxel's three numbers in one, in order."""
HALF = 2**15
CLOUDS = {"car": car_clouds, "gicp": gicp_clouds}


def octomap_of(scans: list[tuple[F64, F64]], resolution_m: float, discretize: bool, folder: Path) -> tuple[Keys, Keys]:
    """Occupied and free voxels of OctoMap, read from the file it writes."""
    tree = octree(resolution_m)
    tree.setProbHit(0.7)
    tree.setProbMiss(0.4)
    tree.setClampingThresMin(0.12)
    tree.setClampingThresMax(0.97)
    for points, origin in scans:
        tree.insertPointCloud(np.ascontiguousarray(points), np.ascontiguousarray(origin), 40.0, False, discretize)
    path = folder / "octomap.bt"
    tree.writeBinary(str(path))
    keys, occupied = read_bt(path.read_bytes()).voxels()
    return keys_of(keys[occupied]), keys_of(keys[~occupied])


def ours_of(scans: list[tuple[F64, F64]], resolution_m: float, discretize: bool) -> tuple[Keys, Keys]:
    voxels = VoxelMap(resolution_m=resolution_m)
    for points, origin in scans:
        voxels.insert(points, origin_enu=origin, max_range_m=40.0, discretize=discretize)
    keys, probability, _ = voxels.known()
    return keys_of(keys[probability > 0.5]), keys_of(keys[probability <= 0.5])


def keys_of(keys: np.ndarray) -> Keys:
    above_zero = keys.astype(np.int64) + HALF
    assert above_zero.min() >= 0
    assert above_zero.max() < 2 * HALF
    return np.unique(np.ravel_multi_index(tuple(above_zero.T), (2 * HALF,) * 3))


def numbers_of(keys: Keys) -> NDArray[np.int64]:
    return np.column_stack(np.unravel_index(keys, (2 * HALF,) * 3)) - HALF


def agreement(a: Keys, b: Keys) -> float:
    return 1.0 - len(np.setxor1d(a, b, assume_unique=True)) / len(np.union1d(a, b))


@pytest.mark.parametrize("discretize", [True, False])
@pytest.mark.parametrize("name", sorted(CLOUDS))
def test_recorded_scans_give_octomaps_map(name: str, discretize: bool, shared_data: Path, tmp_path: Path) -> None:
    """Occupied: the same. Free: a laser that stands exactly on a corner of voxels (both do at first) sends rays through
    edges and corners, where OctoMap's single precision decides by rounding which neighbour they graze."""
    scans = CLOUDS[name](shared_data)
    occupied, free = octomap_of(scans, 0.5, discretize, tmp_path)
    our_occupied, our_free = ours_of(scans, 0.5, discretize)
    assert len(occupied) > 3_000
    assert agreement(our_occupied, occupied) >= 0.999
    assert agreement(our_free, free) >= (0.99 if discretize else 0.999)


def test_one_ray_per_voxel_differs_from_one_per_point_only_at_the_rim(shared_data: Path) -> None:
    """What lies within half a voxel of the largest range is judged by the voxel's centre or by the point."""
    scans = car_clouds(shared_data)
    by_voxel, _ = ours_of(scans, 0.5, True)
    by_point, _ = ours_of(scans, 0.5, False)
    different = (numbers_of(np.setxor1d(by_voxel, by_point)) + 0.5) * 0.5
    assert agreement(by_voxel, by_point) >= 0.999
    assert np.all(np.abs(np.linalg.norm(different, axis=1) - 40.0) < 0.5 * np.sqrt(3) / 2 + 0.25)


@pytest.mark.slow
@pytest.mark.parametrize(("resolution_m", "every"), [(0.1, 36), (0.2, 9), (1.0, 3)])
def test_other_resolutions_agree_as_well(resolution_m: float, every: int, shared_data: Path, tmp_path: Path) -> None:
    for name in sorted(CLOUDS):
        scans = [(points[::every], origin + 0.013) for points, origin in CLOUDS[name](shared_data)]
        occupied, free = octomap_of(scans, resolution_m, True, tmp_path)
        our_occupied, our_free = ours_of(scans, resolution_m, True)
        assert agreement(our_occupied, occupied) >= 0.999
        assert agreement(our_free, free) >= 0.995


def test_a_flight_of_a_stereo_camera_gives_octomaps_map(tmp_path: Path) -> None:
    places = np.array([(0.437 * n, 0.713 * n, 20.319) for n in range(8)]).astype(np.float32).astype(np.float64)
    scans = [(seen_by_camera(4_000, n) + place, place) for n, place in enumerate(places)]
    occupied, free = octomap_of(scans, 0.5, True, tmp_path)
    our_occupied, our_free = ours_of(scans, 0.5, True)
    assert agreement(our_occupied, occupied) >= 0.999
    assert agreement(our_free, free) >= 0.995
