"""How fast scans go into a map and a region is searched in it, beside OctoMap in the same run.

Processor time of the one thread that each of them uses, so that a busy machine favours neither.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from mapping.geometry.arrays import F64
from mapping.perceiving.roi import search_sector, sector_points, to_enu
from mapping.voxels.map import VoxelMap
from tests.mapping.clouds import forest_clouds, seen_by_camera
from tests.reference.octomap import octree

RESOLUTION_M, RANGE_M = 0.5, 40.0
FOV_RAD = math.radians(24.0)
ORIGIN = np.array([0.1, 0.2, 0.3])

Case = tuple[str, float, float, float, str]
"""name, our seconds, the alternative's seconds, alternative / ours, note"""
Result = TypeVar("Result")


def cases() -> list[Case]:
    """The figures of `make bench` for the voxel maps."""
    clouds = {"a camera's cloud": seen_by_camera, "points all around": _all_around}
    rows = [_insert(name, make(count)) for count in (100_000, 1_000_000) for name, make in clouds.items()]
    return [*rows, _insert_forest(), _search()]


def main() -> None:
    for name, ours_s, alternative_s, ratio, note in cases():
        print(f"{name}: {1e3 * ours_s:.3f} ms against {1e3 * alternative_s:.1f} ms, {ratio:.1f} times as fast; {note}")


def _insert(name: str, points: F64) -> Case:
    def ours() -> VoxelMap:
        voxels = VoxelMap(resolution_m=RESOLUTION_M)
        voxels.insert(points, origin_enu=ORIGIN, max_range_m=RANGE_M)
        return voxels

    def theirs() -> Any:
        tree = octree(RESOLUTION_M)
        tree.insertPointCloud(points, ORIGIN, RANGE_M, False, True)
        return tree

    ours_s, voxels = _best_of(7, ours)
    theirs_s, _ = _best_of(2 if len(points) <= 100_000 else 1, theirs)
    enough = _yes(theirs_s / ours_s, 10.0)
    each_bytes = voxels.size_bytes / voxels.voxel_count
    note = f"{voxels.voxel_count:,} voxels, {each_bytes:.1f} bytes each (at least 10 times: {enough})"
    title = f"insert {len(points):,} points, {name}, into an empty map of {RESOLUTION_M} m, {RANGE_M:.0f} m"
    return f"{title}, against OctoMap with discretize", ours_s, theirs_s, theirs_s / ours_s, note


def _insert_forest() -> Case:
    """Of which a block is known to a fifth."""
    scans, range_m = forest_clouds(4), 50.0

    def ours() -> VoxelMap:
        voxels = VoxelMap(resolution_m=0.2)
        for points, origin in scans:
            voxels.insert(points, origin_enu=origin, max_range_m=range_m)
        return voxels

    def theirs() -> Any:
        tree = octree(0.2)
        for points, origin in scans:
            tree.insertPointCloud(points, origin, range_m, False, True)
        return tree

    ours_s, voxels = _best_of(5, ours)
    theirs_s, _ = _best_of(1, theirs)
    each_bytes = voxels.size_bytes / voxels.voxel_count
    note = f"{voxels.voxel_count:,} voxels, {each_bytes:.1f} bytes each (at most 8: {_yes(8.0, each_bytes)})"
    title = "insert 4 scans of a laser with 64 beams in a forest, 0.2 m, 50 m, against OctoMap with discretize"
    return title, ours_s, theirs_s, theirs_s / ours_s, note


def _search() -> Case:
    """The region of 120 m, 12,699 points, moved to a place and searched."""
    points = sector_points(depth_m=120.0, fov_rad=FOV_RAD, height_m=0.9, resolution_m=RESOLUTION_M)
    cloud = _all_around(100_000) * 3.0
    voxels = VoxelMap(resolution_m=RESOLUTION_M)
    voxels.insert_hits(cloud)
    tree = octree(RESOLUTION_M)
    tree.updateNodes(cloud, True)
    ours_s, _ = _best_of(50, lambda: search_sector(voxels, points, ORIGIN, 0.7))
    theirs_s, _ = _best_of(2, lambda: _search_octomap(tree, points))
    note = f"moving it included (at most 0.1 ms: {_yes(1e-4 / ours_s, 1)})"
    title = f"search the region of 120 m, {len(points):,} points, against OctoMap in a loop"
    return title, ours_s, theirs_s, theirs_s / ours_s, note


def _search_octomap(tree: Any, points: F64) -> int:
    return sum(tree.search(point) is not None for point in to_enu(points, ORIGIN, 0.7))


def _all_around(count: int) -> F64:
    """In every direction, 1 to 40 m away."""
    rng = np.random.default_rng(1)
    towards = rng.normal(size=(count, 3))
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    return ORIGIN + towards * rng.uniform(1.0, RANGE_M, (count, 1))


def _yes(value: float, least: float) -> str:
    return "yes" if value >= least else "NO"


def _best_of(runs: int, run: Callable[[], Result]) -> tuple[float, Result]:
    """Shortest time of ``runs``, after one run that compiles when there are more than two."""
    result = run() if runs > 2 else None
    best_s = float("inf")
    for _ in range(runs):
        start_s = time.thread_time()
        result = run()
        best_s = min(best_s, time.thread_time() - start_s)
    assert result is not None
    return best_s, result


if __name__ == "__main__":
    main()
