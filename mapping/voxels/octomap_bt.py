"""OctoMap's binary trees (.bt): occupied and free space in two bits a node, as OctoMap and its viewers keep it."""

from __future__ import annotations

import numpy as np

from mapping.errors import CapacityError
from mapping.geometry.arrays import I32, I64, U16
from mapping.voxels.map import VoxelMap

FIRST_LINE = b"# Octomap OcTree binary file"
DEPTH = 16
HALF = 1 << (DEPTH - 1)
"""Keys of a tree run from -HALF to HALF - 1."""
FREE, OCCUPIED, INNER = 1, 2, 3
"""Two bits a child."""


def write_bt(voxels: VoxelMap) -> bytes:
    """All known voxels of a map as a file; eight alike become one, as OctoMap prunes.

    Raises CapacityError where the map is wider than OctoMap's 65,536 voxels.
    """
    nodes, body = tree_data(voxels)
    header = f"id OcTree\nsize {nodes}\nres {voxels.resolution_m!r}\ndata\n"
    return (
        FIRST_LINE
        + b"\n# (feel free to add / change comments, but leave the first line as it is!)\n"
        + header.encode()
        + body
    )


def tree_data(voxels: VoxelMap) -> tuple[int, bytes]:
    """Number of nodes, and what follows a file's header; it is the ``data`` of ROS's octomap_msgs/Octomap as well.

    Raises CapacityError as ``write_bt`` does.
    """
    keys, _, _ = voxels.known()
    occupied = voxels.occupied_keys()
    if len(keys) and (keys.min() < -HALF or keys.max() >= HALF):
        raise CapacityError(
            f"The map reaches {max(-int(keys.min()), int(keys.max())):,} voxels from its origin; "
            f"an OctoMap file ends at {HALF:,}.",
            advice="Export it as .ply, or take its origin nearer.",
        )
    return _tree_bytes(keys, occupied)


def _tree_bytes(keys: I32, occupied_keys: I32) -> tuple[int, bytes]:
    """Number of nodes, and two bytes per inner node in the order of a walk that goes deep first."""
    codes = _morton(keys)
    order = np.argsort(codes)
    codes = codes[order]
    kinds = np.full(len(codes), FREE, np.uint32)
    kinds[np.searchsorted(codes, _morton(occupied_keys))] = OCCUPIED
    nodes = len(codes)
    levels: list[tuple[int, I64, U16]] = []
    for depth in range(DEPTH - 1, -1, -1):
        parents, first = np.unique(codes >> 3, return_index=True)
        if not len(parents):
            return 0, b""
        patterns = np.bitwise_or.reduceat(kinds << (2 * (codes & 7)).astype(np.uint32), first)
        alike = ((patterns == 0x5555) | (patterns == 0xAAAA)) & (depth > 0)
        nodes += len(parents) - 8 * int(alike.sum())
        levels.append((depth, parents[~alike], patterns[~alike].astype("<u2")))
        codes, kinds = parents, np.where(alike, patterns & 3, INNER).astype(np.uint32)
    starts = np.concatenate([parents << (3 * (DEPTH - depth)) for depth, parents, _ in levels])
    depths = np.concatenate([np.full(len(parents), depth) for depth, parents, _ in levels])
    patterns = np.concatenate([patterns for _, _, patterns in levels])
    return nodes, patterns[np.lexsort((depths, starts))].tobytes()


def _morton(keys: I32) -> I64:
    """(N,) bits of x, y and z in turn, x lowest: the path from the root, three bits a level."""
    code = np.zeros(len(keys), np.int64)
    for axis in range(3):
        part = keys[:, axis].astype(np.int64) + HALF
        for shift, mask in (
            (32, 0x1F00000000FFFF),
            (16, 0x1F0000FF0000FF),
            (8, 0x100F00F00F00F00F),
            (4, 0x10C30C30C30C30C3),
            (2, 0x1249249249249249),
        ):
            part = (part | part << shift) & mask
        code |= part << axis
    return code
