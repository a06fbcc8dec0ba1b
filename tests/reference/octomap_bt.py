"""OctoMap's binary trees (.bt) read back, after its documentation: what is written is held against that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import I32, Bools
from mapping.voxels.map import VoxelMap
from mapping.voxels.octomap_bt import DEPTH, FIRST_LINE, HALF, INNER, OCCUPIED


@dataclass(frozen=True, slots=True)
class OccupancyTree:
    """The leaves of a tree; large ones stand for cubes of voxels that are all alike."""

    resolution_m: float
    node_count: int
    """Inner nodes and leaves, as the file's header says."""
    keys: I32
    """(N, 3) lowest voxel of each leaf, floor(metres / resolution)"""
    edge_voxels: I32
    """(N,) powers of two"""
    occupied: Bools
    """(N,)"""

    def voxels(self) -> tuple[I32, Bools]:
        """Keys (M, 3) and occupied (M,) of single voxels."""
        parts = [self._of_edge(int(edge)) for edge in np.unique(self.edge_voxels)]
        if not parts:
            return np.empty((0, 3), np.int32), np.empty(0, np.bool_)
        return np.concatenate([keys for keys, _ in parts]), np.concatenate([occupied for _, occupied in parts])

    def _of_edge(self, edge: int) -> tuple[I32, Bools]:
        chosen = self.edge_voxels == edge
        inside = np.stack(np.meshgrid(*[np.arange(edge, dtype=np.int32)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        keys = (self.keys[chosen][:, None, :] + inside[None, :, :]).reshape(-1, 3)
        return keys, np.repeat(self.occupied[chosen], len(inside))


def read_bt(data: bytes) -> OccupancyTree:
    """Reads OcTree and its kin (ColorOcTree and so on; a .bt holds no colours)."""
    head, content = data.split(b"\ndata\n", 1)
    assert head.startswith(FIRST_LINE)
    fields = dict(line.split(b" ", 1) for line in head.splitlines() if not line.startswith(b"#"))
    resolution_m, size = float(fields[b"res"]), int(fields[b"size"])
    body = np.frombuffer(content, dtype=np.uint8)
    if size == 0 and not len(body):
        return OccupancyTree(resolution_m, 0, np.empty((0, 3), np.int32), np.empty(0, np.int32), np.empty(0, np.bool_))
    leaves, nodes, end = _count(body)
    assert (nodes, end) == (size, len(body)), "as many nodes as the header says, and nothing left over"
    keys, edges = np.empty((leaves, 3), np.int32), np.empty(leaves, np.int32)
    occupied = np.empty(leaves, np.bool_)
    _read(body, keys, edges, occupied)
    return OccupancyTree(resolution_m, nodes, keys, edges, occupied)


def map_from_bt(data: bytes, *, memory_limit_bytes: int = 1_000_000_000) -> VoxelMap:
    """The tree as a map with OctoMap's clamp: occupied voxels at its upper bound, free ones at its lower."""
    tree = read_bt(data)
    voxels = VoxelMap(resolution_m=tree.resolution_m, memory_limit_bytes=memory_limit_bytes)
    voxels.assign(*tree.voxels())
    assert not voxels.refused_updates
    return voxels


@njit(cache=True, nogil=True)
def _count(body):
    """Leaves, nodes and bytes of the tree; bytes -1: cut off, -2: deeper than 16 levels."""
    depths = np.empty(8 * DEPTH, np.int64)
    depths[0] = 0
    size, at = 1, 0
    leaves, nodes = 0, 1
    while size > 0:
        size -= 1
        depth = depths[size]
        if at + 2 > body.size:
            return leaves, nodes, -1
        for half in range(2):
            for child in range(4):
                kind = body[at + half] >> (2 * child) & 3
                if kind == 0:
                    continue
                nodes += 1
                if kind != INNER:
                    leaves += 1
                elif depth + 1 == DEPTH:
                    return leaves, nodes, -2
                else:
                    depths[size] = depth + 1
                    size += 1
        at += 2
    return leaves, nodes, at


@njit(cache=True, nogil=True)
def _read(body, keys, edges, occupied):
    """Fills in the leaves of a tree that ``_count`` found good: depth first, children 0 to 7."""
    stack = np.empty((8 * DEPTH, 4), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = -HALF, -HALF, -HALF, 2 * HALF
    size, at, leaf = 1, 0, 0
    while size > 0:
        size -= 1
        x0, y0, z0 = stack[size, 0], stack[size, 1], stack[size, 2]
        edge = stack[size, 3] // 2
        for child in range(7, -1, -1):  # the last one lies deepest on the stack
            kind = body[at + child // 4] >> (2 * (child % 4)) & 3
            if kind == 0:
                continue
            x, y, z = x0 + edge * (child & 1), y0 + edge * (child >> 1 & 1), z0 + edge * (child >> 2)
            if kind == INNER:
                stack[size, 0], stack[size, 1], stack[size, 2], stack[size, 3] = x, y, z, edge
                size += 1
            else:
                keys[leaf, 0], keys[leaf, 1], keys[leaf, 2] = x, y, z
                edges[leaf] = edge
                occupied[leaf] = kind == OCCUPIED
                leaf += 1
        at += 2
