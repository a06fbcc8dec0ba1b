"""OctoMap's .bt files: recorded maps, round trips, what OctoMap reads of ours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapping.errors import CapacityError
from mapping.voxels.map import VoxelMap
from mapping.voxels.octomap_bt import write_bt
from tests.reference.octomap import octree
from tests.reference.octomap_bt import map_from_bt, read_bt

FILES = {"octomap/geb079.bt": (532_566, 0.08), "freiburg1/freiburg1_360.bt": (1_547_112, 0.02)}
key_arrays = arrays(np.int32, st.tuples(st.integers(1, 60), st.just(3)), elements=st.integers(-40, 40))


def small_map(keys: np.ndarray, occupied: np.ndarray, resolution_m: float = 0.1) -> VoxelMap:
    voxels = VoxelMap(resolution_m=resolution_m, memory_limit_bytes=4_000_000)
    voxels.assign(keys, occupied)
    return voxels


def content(voxels: VoxelMap) -> set[tuple[int, ...]]:
    keys, probability, _ = voxels.known()
    return set(map(tuple, np.column_stack([keys, probability > 0.5]).tolist()))


@pytest.mark.parametrize("name", sorted(FILES))
def test_recorded_maps_have_as_many_nodes_as_they_say(name: str, shared_data: Path) -> None:
    nodes, resolution_m = FILES[name]
    tree = read_bt((shared_data / "maps" / name).read_bytes())
    assert (tree.node_count, tree.resolution_m) == (nodes, resolution_m)
    assert len(tree.keys) == len(tree.occupied) == len(tree.edge_voxels) > nodes // 2


def test_a_recorded_map_is_written_as_octomap_wrote_it(shared_data: Path) -> None:
    data = (shared_data / "maps" / "octomap" / "geb079.bt").read_bytes()
    voxels = map_from_bt(data)
    assert voxels.voxel_count == len(read_bt(data).voxels()[0])
    written = write_bt(voxels)
    assert b"\nsize 532566\nres 0.08\n" in written
    assert written.split(b"\ndata\n", 1)[1] == data.split(b"\ndata\n", 1)[1]


@given(key_arrays, st.integers(0, 2**32))
def test_what_is_written_is_read_again(keys: np.ndarray, seed: int) -> None:
    voxels = small_map(keys, np.random.default_rng(seed).random(len(keys)) > 0.5)
    data = write_bt(voxels)
    again = map_from_bt(data, memory_limit_bytes=4_000_000)
    assert content(again) == content(voxels)
    assert write_bt(again) == data


def test_eight_alike_become_one() -> None:
    keys = np.stack(np.meshgrid(*[np.arange(16)] * 3), axis=-1).reshape(-1, 3)
    tree = read_bt(write_bt(small_map(keys, np.ones(len(keys), bool))))
    assert tree.edge_voxels.tolist() == [16]
    assert tree.keys.tolist() == [[0, 0, 0]]
    assert tree.node_count == 13, "the root and one node on each of twelve levels"


def test_octomap_reads_what_we_write(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    keys = np.unique(rng.integers(-300, 300, (4_000, 3)), axis=0)
    occupied = rng.random(len(keys)) > 0.4
    path = tmp_path / "ours.bt"
    path.write_bytes(write_bt(small_map(keys, occupied, 0.25)))
    tree = octree(1.0)
    assert tree.readBinary(str(path))
    assert tree.getResolution() == 0.25
    assert tree.size() == tree.calcNumNodes() == read_bt(path.read_bytes()).node_count
    for key, expected in zip(keys[:400], occupied[:400], strict=True):
        node = tree.search((key + 0.5) * 0.25)
        assert tree.isNodeOccupied(node) == expected


def test_we_read_what_octomap_writes(tmp_path: Path) -> None:
    tree = octree(0.2)
    points = np.random.default_rng(6).uniform(-5.0, 5.0, (300, 3))
    tree.insertPointCloud(points, np.array([0.01, 0.02, 0.03]))
    path = tmp_path / "theirs.bt"
    tree.writeBinary(str(path))
    voxels = map_from_bt(path.read_bytes())
    assert np.all(voxels.probability(points) > 0.9)
    assert voxels.voxel_count > voxels.occupied_count >= 290


def test_an_empty_map_is_an_empty_tree(tmp_path: Path) -> None:
    data = write_bt(small_map(np.empty((0, 3)), np.empty(0, bool)))
    assert read_bt(data).node_count == 0
    assert map_from_bt(data).voxel_count == 0
    path = tmp_path / "empty.bt"
    path.write_bytes(data)
    assert octree(1.0).readBinary(str(path))


def test_a_map_wider_than_a_tree_is_refused_with_the_number() -> None:
    with pytest.raises(CapacityError, match="40,000 voxels from its origin"):
        write_bt(small_map(np.array([[40_000, 0, 0]]), np.array([True])))
