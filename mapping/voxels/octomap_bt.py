"""OctoMap's binary trees (.bt): occupied and free space in two bits a node, as OctoMap and its viewers keep it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.errors import CapacityError, FormatError
from mapping.geometry.arrays import I32, I64, U16, Bools
from mapping.voxels import VoxelMap

FIRST_LINE = b"# Octomap OcTree binary file"
DEPTH = 16
HALF = 1 << (DEPTH - 1)
"""Keys of a tree run from -HALF to HALF - 1."""
FREE, OCCUPIED, INNER = 1, 2, 3
"""Two bits a child."""
LONGEST_HEADER = 4096
MOST_VOXELS = 50_000_000


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

    @property
    def voxel_count(self) -> int:
        return int((self.edge_voxels.astype(np.int64) ** 3).sum())

    def voxels(self) -> tuple[I32, Bools]:
        """Keys (M, 3) and occupied (M,) of single voxels. Raises CapacityError beyond ``MOST_VOXELS``."""
        if self.voxel_count > MOST_VOXELS:
            raise CapacityError(
                f"The tree stands for {self.voxel_count:,} voxels of {self.resolution_m:g} m; "
                f"{MOST_VOXELS:,} is the most.",
                advice="Use a part of it, or a coarser tree.",
            )
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
    """Reads OcTree and its kin (ColorOcTree and so on; a .bt holds no colours). Raises FormatError."""
    resolution_m, size, start = _header(data)
    body = np.frombuffer(data, dtype=np.uint8, offset=start)
    if size == 0 and not len(body):
        return OccupancyTree(resolution_m, 0, np.empty((0, 3), np.int32), np.empty(0, np.int32), np.empty(0, np.bool_))
    leaves, nodes, end = _count(body)
    if end < 0:
        raise FormatError(*_broken("The data end in the middle of the tree" if end == -1 else "The tree is too deep"))
    if end < len(body):
        raise FormatError(*_broken(f"{len(body) - end:,} bytes are left over behind the tree"))
    if nodes != size:
        raise FormatError(*_broken(f"The header says {size:,} nodes, the data hold {nodes:,}"))
    keys, edges = np.empty((leaves, 3), np.int32), np.empty(leaves, np.int32)
    occupied = np.empty(leaves, np.bool_)
    _read(body, keys, edges, occupied)
    return OccupancyTree(resolution_m, nodes, keys, edges, occupied)


def map_from_bt(data: bytes, *, memory_limit_bytes: int = 1_000_000_000) -> VoxelMap:
    """The tree as a map with OctoMap's clamp: occupied voxels at its upper bound, free ones at its lower.

    Raises FormatError, and CapacityError where the map would be larger than ``memory_limit_bytes``.
    """
    tree = read_bt(data)
    voxels = VoxelMap(resolution_m=tree.resolution_m, memory_limit_bytes=memory_limit_bytes)
    keys, occupied = tree.voxels()
    voxels.assign(keys, occupied)
    if voxels.refused_updates:
        raise CapacityError(
            f"{voxels.refused_updates:,} of {tree.voxel_count:,} voxels do not fit in "
            f"{memory_limit_bytes / 1e6:,.0f} MB.",
            where="memory_limit_bytes",
            advice="Allow more memory.",
        )
    return voxels


def write_bt(voxels: VoxelMap) -> bytes:
    """All known voxels of a map; eight alike become one, as OctoMap prunes.

    Raises CapacityError where the map is wider than OctoMap's 65,536 voxels.
    """
    keys, _, _ = voxels.known()
    occupied = voxels.occupied_keys()
    if len(keys) and (keys.min() < -HALF or keys.max() >= HALF):
        raise CapacityError(
            f"The map reaches {max(-int(keys.min()), int(keys.max())):,} voxels from its origin; "
            f"an OctoMap file ends at {HALF:,}.",
            advice="Export it as .ply, or take its origin nearer.",
        )
    nodes, body = _tree_bytes(keys, occupied)
    header = f"id OcTree\nsize {nodes}\nres {voxels.resolution_m!r}\ndata\n"
    return (
        FIRST_LINE
        + b"\n# (feel free to add / change comments, but leave the first line as it is!)\n"
        + header.encode()
        + body
    )


def _broken(what: str) -> tuple[str]:
    return (f"{what}: the file is broken or cut off.",)


def _header(data: bytes) -> tuple[float, int, int]:
    """Resolution, number of nodes, and where the data begin."""
    if not data.startswith(FIRST_LINE):
        if data.startswith(b"# Octomap OcTree file"):
            raise FormatError(
                "This is OctoMap's full format (.ot).", advice="Convert it to .bt (octree2pointcloud, convert_octree)."
            )
        raise FormatError(
            "This is no OctoMap binary tree (.bt).", advice=f"Its first line must be: {FIRST_LINE.decode()}"
        )
    fields: dict[bytes, bytes] = {}
    place = 0
    while place < min(len(data), LONGEST_HEADER):
        end = data.find(b"\n", place, LONGEST_HEADER)
        if end < 0:
            break
        line, place = data[place:end].strip(), end + 1
        if line == b"data":
            return _number(fields, b"res"), int(_number(fields, b"size")), place
        if line and not line.startswith(b"#"):
            name, _, value = line.partition(b" ")
            fields[name] = value.strip()
    raise FormatError("The header has no line that says 'data'.", advice="The file is broken or cut off.")


def _number(fields: dict[bytes, bytes], name: bytes) -> float:
    text = fields.get(name, b"")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and (value > 0.0 or (name == b"size" and value == 0.0))):
        raise FormatError(
            f"The header says '{text.decode(errors='replace')}' for {name.decode()}.", advice="The file is broken."
        )
    return value


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
