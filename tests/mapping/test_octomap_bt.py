"""OctoMap's .bt files: recorded maps, round trips, what OctoMap reads of ours, broken files."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapping.errors import CapacityError, FormatError
from mapping.voxels import VoxelMap
from mapping.voxels.octomap_bt import map_from_bt, read_bt, write_bt
from tests.reference.octomap import octree

FILES = {"octomap/geb079.bt": (532_566, 0.08), "freiburg1/freiburg1_360.bt": (1_547_112, 0.02)}
key_arrays = arrays(np.int32, st.tuples(st.integers(1, 60), st.just(3)), elements=st.integers(-40, 40))


def small_map(keys: np.ndarray, occupied: np.ndarray, resolution_m: float = 0.1) -> VoxelMap:
    voxels = VoxelMap(resolution_m=resolution_m, memory_limit_bytes=4_000_000)
    voxels.assign(keys, occupied)
    return voxels


def content(voxels: VoxelMap) -> set[tuple[int, ...]]:
    keys, probability, _ = voxels.known()
    return set(map(tuple, np.column_stack([keys, probability > 0.5]).tolist()))


@pytest.fixture(scope="module")
def example() -> bytes:
    rng = np.random.default_rng(7)
    keys = rng.integers(-20, 20, (500, 3))
    return write_bt(small_map(keys, keys[:, 0] > 0))


@pytest.mark.parametrize("name", sorted(FILES))
def test_recorded_maps_have_as_many_nodes_as_they_say(name: str, shared_data: Path) -> None:
    nodes, resolution_m = FILES[name]
    tree = read_bt((shared_data / "maps" / name).read_bytes())
    assert (tree.node_count, tree.resolution_m) == (nodes, resolution_m)
    assert len(tree.keys) == len(tree.occupied) == len(tree.edge_voxels) > nodes // 2


def test_a_recorded_map_is_written_as_octomap_wrote_it(shared_data: Path) -> None:
    data = (shared_data / "maps" / "octomap" / "geb079.bt").read_bytes()
    voxels = map_from_bt(data)
    assert voxels.voxel_count == read_bt(data).voxel_count
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


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda data: b"", "no OctoMap binary tree"),
        (lambda data: b"ply\n" + data, "no OctoMap binary tree"),
        (lambda data: data.replace(b"OcTree binary file", b"OcTree file"), r"full format \(\.ot\)"),
        (lambda data: data.replace(b"\ndata\n", b"\n"), "no line that says 'data'"),
        (lambda data: data.replace(b"res 0.1", b"res -3"), "'-3' for res"),
        (lambda data: data.replace(b"res 0.1", b"res"), "'' for res"),
        (lambda data: data.replace(b"size ", b"size x"), "for size"),
        (lambda data: data.replace(b"size ", b"size 9"), "The header says 9"),
        (lambda data: data[:-3], "end in the middle"),
        (lambda data: data + b"\0\0", "2 bytes are left over"),
        (lambda data: data[: data.index(b"\ndata\n") + 6] + b"\xff" * 400, "too deep"),
    ],
)
def test_broken_files_are_refused_with_the_reason(example: bytes, change: object, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        read_bt(change(example))  # type: ignore[operator]


@given(st.data())
def test_damaged_bytes_never_do_more_than_be_refused(data: st.DataObject) -> None:
    good = bytearray(write_bt(small_map(np.array([[1, 2, 3], [-9, 8, 7]]), np.array([True, False]))))
    for _ in range(data.draw(st.integers(1, 5))):
        good[data.draw(st.integers(0, len(good) - 1))] = data.draw(st.integers(0, 255))
    tree = None
    with contextlib.suppress(FormatError):
        tree = read_bt(bytes(good))
    assert tree is None or len(tree.keys) <= tree.node_count


def test_a_leaf_as_large_as_half_the_world_is_not_unfolded() -> None:
    data = b"# Octomap OcTree binary file\nid OcTree\nsize 2\nres 0.1\ndata\n\x02\x00"
    assert read_bt(data).edge_voxels.tolist() == [32_768]
    with pytest.raises(CapacityError, match="35,184,372,088,832 voxels"):
        map_from_bt(data)


def test_a_tree_larger_than_the_memory_is_refused_with_the_number(example: bytes) -> None:
    with pytest.raises(CapacityError, match="do not fit in 0 MB"):
        map_from_bt(example, memory_limit_bytes=100_000)


def test_a_map_wider_than_a_tree_is_refused_with_the_number() -> None:
    with pytest.raises(CapacityError, match="40,000 voxels from its origin"):
        write_bt(small_map(np.array([[40_000, 0, 0]]), np.array([True])))
