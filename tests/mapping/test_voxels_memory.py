"""What a map costs, how its arrays grow without losing anything, and what it does when they are full."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

from mapping.voxels import store
from mapping.voxels.map import VoxelMap
from tests.mapping.clouds import seen_by_camera
from tests.mapping.test_voxels import ORIGIN, content, small_map


def test_no_change_is_lost_while_the_log_grows_with_the_map(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "FIRST_LOG", 16)
    voxels, rng = small_map(1.0), np.random.default_rng(4)
    followed: dict[tuple[int, ...], tuple[float, bool]] = {}
    revision, wholes = 0, []
    for scan in range(900):
        voxels.insert_hits(rng.uniform(-8.0, 8.0, (4, 3)))
        if scan % 3 != 2:
            continue  # a growth lies between the changes that are asked for
        changes = voxels.changed_since(revision)
        wholes.append(changes.whole)
        values = zip(changes.probability.tolist(), changes.explained.tolist(), strict=True)
        followed.update(zip(map(tuple, changes.keys.tolist()), values, strict=True))
        revision = changes.revision
    assert voxels.blocks.counts[store.LOG_MASK] + 1 == 1024
    assert not any(wholes)
    assert followed == content(voxels)


def test_another_thread_finds_what_was_there_while_the_table_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "FIRST_TABLE", 4)
    voxels = VoxelMap(resolution_m=1.0, memory_limit_bytes=40_000_000)
    first = np.array([[0.5, 0.5, 0.5], [100.5, 0.5, 0.5]])
    voxels.insert_hits(first)
    missed, looked, ends = [], threading.Event(), threading.Event()

    def look() -> None:
        while not ends.is_set():
            missed.extend(np.flatnonzero(~(voxels.probability(first) >= 0.7)))
            looked.set()

    reader = threading.Thread(target=look)
    reader.start()
    rng = np.random.default_rng(5)
    try:
        assert looked.wait(60.0)
        for _ in range(40):
            voxels.insert_hits(rng.uniform(-2_000.0, 2_000.0, (250, 3)))
    finally:
        ends.set()
        reader.join()
    assert missed == []
    assert voxels.blocks.counts[store.TABLE_FIRST] >= 16_384


def test_a_map_that_has_all_the_values_it_can_tell_apart_takes_the_next_higher_one() -> None:
    usual, full = small_map(), small_map()
    values, counts = full.blocks.values, full.blocks.counts
    filling = np.linspace(-1.9, 3.4, store.VALUE + 1 - counts[store.N_VALUES], dtype=np.float32)
    values[counts[store.N_VALUES] :] = filling
    full.blocks.kinds[counts[store.N_VALUES] :] = np.where(filling > 0.0, store.KNOWN | store.OCCUPIED, store.KNOWN)
    counts[store.N_VALUES] = store.VALUE + 1
    rng = np.random.default_rng(6)
    for _ in range(12):
        cloud = rng.uniform(-6.0, 6.0, (20, 3))
        for voxels in (usual, full):
            voxels.insert(cloud, origin_enu=ORIGIN, max_range_m=10.0)
    exact, rounded = content(usual), content(full)
    assert exact.keys() == rounded.keys()
    more = np.array([rounded[key][0] - exact[key][0] for key in exact])
    assert more.min() >= -1e-6
    assert 0.0 < more.max() < 0.01


def test_misses_free_a_voxel_also_where_a_full_map_cannot_tell_them_apart() -> None:
    voxels = small_map(prob_miss=0.4999)
    values, counts = voxels.blocks.values, voxels.blocks.counts
    values[counts[store.N_VALUES] :] = np.linspace(-1.9, 3.4, store.VALUE + 1 - counts[store.N_VALUES])
    voxels.blocks.kinds[counts[store.N_VALUES] :] = np.where(
        values[counts[store.N_VALUES] :] > 0.0, store.KNOWN | store.OCCUPIED, store.KNOWN
    )
    counts[store.N_VALUES] = store.VALUE + 1
    hit, beyond = [[2.25, 0.25, 0.25]], [[4.25, 0.25, 0.25]]
    voxels.insert_hits(hit)
    before = voxels.probability(hit)[0]
    for _ in range(3_000):
        voxels.insert(beyond, origin_enu=(0.25, 0.25, 0.25), max_range_m=10.0)
    assert before == pytest.approx(0.7, abs=0.01)
    assert voxels.probability(hit)[0] < 0.5


def test_the_grid_of_a_wide_scan_is_given_back_when_scans_are_small_again() -> None:
    voxels, rng = VoxelMap(resolution_m=0.5), np.random.default_rng(14)
    wide, small = rng.uniform(-90.0, 90.0, (30_000, 3)), rng.uniform(-4.0, 4.0, (20, 3))
    voxels.insert(wide, origin_enu=ORIGIN, max_range_m=300.0)
    largest_bytes = voxels.grid_bytes
    assert largest_bytes > 360**3
    sizes = []
    for _ in range(200):
        voxels.insert(small, origin_enu=ORIGIN, max_range_m=300.0)
        sizes.append(voxels.grid_bytes)
    assert sizes[20] == largest_bytes, "not for a few small ones"
    assert sizes[-1] < largest_bytes / 4
    voxels.insert(wide, origin_enu=ORIGIN, max_range_m=300.0)
    assert voxels.grid_bytes >= 360**3


def test_points_that_are_none_need_no_grid() -> None:
    voxels, points = VoxelMap(resolution_m=0.1), np.full((300_000, 3), math.nan)
    points[:3] = 46.0 * np.eye(3)
    voxels.insert(points, origin_enu=(0.0, 0.0, 0.0), max_range_m=120.0)
    assert voxels.occupied_count == 3
    assert voxels.grid_bytes == 0


@pytest.mark.parametrize("count", [2_000, 10_000, 50_000])
def test_what_a_camera_sees_costs_at_most_eight_bytes_a_voxel(count: int) -> None:
    """After one look and after many: what is kept of changes is little beside the map itself."""
    voxels = VoxelMap(resolution_m=0.5)
    for look in range(40):
        voxels.insert(seen_by_camera(count, look), origin_enu=ORIGIN, max_range_m=40.0)
        assert voxels.size_bytes / voxels.voxel_count <= 8.0
    assert voxels.revision > voxels.voxel_count
