"""First step of a scan: marks voxels in which points lie, and collects the ends of the rays, one per voxel."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit

from mapping.geometry.arrays import I64, U8
from mapping.voxels.blocks import touch, voxel_in
from mapping.voxels.store import (
    HIT,
    N_REFUSED,
    SIDE,
    SIDE_BITS,
    UNEXPLAINED_HIT,
    VOXELS,
)

LARGEST_KEY = 1 << 30
"""Farther out keys would not fit in 32 bits."""
MAX_RANGE_VOXELS = 1 << 15
"""How far a ray may go, as in OctoMap."""
BLOCK_BITS = 3 * SIDE_BITS
HIT_WORDS, UNEXPLAINED_WORDS = VOXELS // 64, 2 * VOXELS // 64
"""Where these begin in a page of marks."""


class Grid(NamedTuple):
    """A byte for every voxel around the sensor: where the rays of an ordinary scan cross, so that nothing is looked up.

    A scan that is too wide for it (no ``marks``) leaves its marks in pages, one per block: slower, the same outcome.
    """

    marks: U8
    """MISS, HIT, UNEXPLAINED_HIT of every voxel, block by block and in a block as its voxels are numbered: a brick is
    a word, what a ray crosses one after the other lies together; zeros between scans"""
    touched: U8
    """(blocks, rounded up to a multiple of 8) 1 where any of a block's marks is set; zeros between scans"""
    at_x: I64
    """(8 * blocks along x,) where a voxel's mark is: the sum of one number for each of its coordinates in the grid"""
    at_y: I64
    at_z: I64
    x0: int
    """Key of its lowest voxel, multiples of 8."""
    y0: int
    z0: int


_NOWHERE = np.zeros(0, np.int64)
NO_GRID = Grid(np.zeros(0, np.uint8), np.zeros(0, np.uint8), _NOWHERE, _NOWHERE, _NOWHERE, 0, 0, 0)


@lru_cache(maxsize=24)
def along(axis: int, blocks: int, stride: int) -> I64:
    """(8 * blocks,) what each coordinate along an axis adds to a mark's place; ``stride`` blocks from one to the next.

    Within a block as ``voxel_in`` numbers its voxels.
    """
    key = np.arange(SIDE * blocks, dtype=np.int64)
    return (key >> SIDE_BITS) * (stride * VOXELS) | (key & 6) << (2 + 2 * axis) | (key & 1) << axis


@njit(cache=True, nogil=True)
def box_around(points, origin, max_range):
    """Lowest and highest corner (2, 3) of where rays from ``origin`` to ``points`` (N, 3) can lead."""
    box = np.empty((2, 3))
    for axis in range(3):
        lowest, highest = origin[axis] - max_range, origin[axis] + max_range
        box[0, axis], box[1, axis] = origin[axis], origin[axis]
        for i in range(points.shape[0]):
            value = points[i, axis]
            if abs(value) < np.inf:
                box[0, axis] = min(box[0, axis], max(value, lowest))
                box[1, axis] = max(box[1, axis], min(value, highest))
    return box


@njit(cache=True, nogil=True)
def count_with_key(points, resolution):
    """How many of ``points`` (N, 3) are finite and near enough for a key: no others have a ray."""
    scale, n = 1.0 / resolution, 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] * scale, points[i, 1] * scale, points[i, 2] * scale
        n += abs(x) < LARGEST_KEY and abs(y) < LARGEST_KEY and abs(z) < LARGEST_KEY
    return n


@njit(cache=True, nogil=True)
def mark_points(store, grid, points, unexplained, resolution, origin, max_range, discretize, ends):
    """Marks the voxels of ``points`` (N, 3) that lie within ``max_range`` of ``origin``; how many ``ends`` there are.

    ``ends`` (M, 3) receives where rays end: with ``discretize`` the centre of every voxel that holds points, once,
    else every point. M = 0: no rays are wanted. ``unexplained`` has one truth per point, or one for all. Points that
    are not finite or too far out for a key are left out; so are voxels that no memory is left for.
    """
    scale = 1.0 / resolution
    ox, oy, oz = origin[0], origin[1], origin[2]
    reach_sq = max_range * max_range
    marks, pages, counts = grid.marks, store.marks, store.counts
    at_x, at_y, at_z = grid.at_x, grid.at_y, grid.at_z
    in_grid, wanted = marks.size > 0, ends.shape[0] > 0
    one_verdict = unexplained.size == 1
    others = np.empty(points.shape[0] if wanted and discretize else 0, np.int64)
    n_ends, n_others = 0, 0
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        fx, fy, fz = px * scale, py * scale, pz * scale
        if not (abs(fx) < LARGEST_KEY and abs(fy) < LARGEST_KEY and abs(fz) < LARGEST_KEY):
            continue
        x, y, z = math.floor(fx), math.floor(fy), math.floor(fz)
        hit = HIT | UNEXPLAINED_HIT if unexplained[0 if one_verdict else i] else HIT
        # Beyond the grid lies what is beyond the range; negative numbers are large ones.
        ux, uy, uz = np.uint64(x - grid.x0), np.uint64(y - grid.y0), np.uint64(z - grid.z0)
        place = np.uint64(0)
        if ux < np.uint64(at_x.size) and uy < np.uint64(at_y.size) and uz < np.uint64(at_z.size):
            place = np.uint64(at_x[ux] + at_y[uy] + at_z[uz])
            if discretize and marks[place] & hit == hit:
                continue  # one more point in a voxel that has been judged: by its centre, as all of them are
        if discretize:
            px, py, pz = (x + 0.5) * resolution, (y + 0.5) * resolution, (z + 0.5) * resolution
        seen = (px - ox) ** 2 + (py - oy) ** 2 + (pz - oz) ** 2 <= reach_sq
        fresh = True
        if seen:
            if in_grid:
                fresh = marks[place] & HIT == 0
                marks[place] |= np.uint8(hit)
                grid.touched[place >> np.uint64(BLOCK_BITS)] = 1
            else:
                page = touch(store, x >> SIDE_BITS, y >> SIDE_BITS, z >> SIDE_BITS)
                if page >= 0:
                    voxel = voxel_in(x, y, z)
                    word, bit = voxel >> 6, np.uint64(1) << np.uint64(voxel & 63)
                    fresh = pages[page, HIT_WORDS + word] & bit == 0
                    pages[page, HIT_WORDS + word] |= bit
                    if hit & UNEXPLAINED_HIT:
                        pages[page, UNEXPLAINED_WORDS + word] |= bit
                else:
                    counts[N_REFUSED] += 1
                    seen = False
        if not wanted:
            continue
        if discretize and not seen:
            others[n_others] = i
            n_others += 1
        elif fresh or not discretize:
            ends[n_ends, 0], ends[n_ends, 1], ends[n_ends, 2] = px, py, pz
            n_ends += 1
    if n_others > 0:
        n_ends = _ends_without_voxel(points, others[:n_others], resolution, ends, n_ends)
    return n_ends


@njit(cache=True, nogil=True)
def _ends_without_voxel(points, others, resolution, ends, n_ends):
    """Appends, once each, the centres of voxels that are beyond the range or that were refused."""
    size = 16
    while size < 2 * others.size:
        size *= 2
    seen = np.full((size, 3), LARGEST_KEY + 1, np.int32)
    scale = 1.0 / resolution
    for i in others:
        x, y, z = math.floor(points[i, 0] * scale), math.floor(points[i, 1] * scale), math.floor(points[i, 2] * scale)
        if _remember(seen, x, y, z):
            ends[n_ends, 0], ends[n_ends, 1] = (x + 0.5) * resolution, (y + 0.5) * resolution
            ends[n_ends, 2] = (z + 0.5) * resolution
            n_ends += 1
    return n_ends


@njit(cache=True, nogil=True)
def _remember(table, x, y, z):
    """Whether the key was not in the set ``table`` (n, 3) yet; it is then. The set must have room."""
    mask = table.shape[0] - 1
    h = x * 0x2545F4914F6CDD1D + y * 0x1B873593CC9E2D51 + z * 0x369DEA0F31A53F85
    place = (h ^ (h >> 29) ^ (h >> 47)) & mask
    while table[place, 0] != LARGEST_KEY + 1:
        if table[place, 0] == x and table[place, 1] == y and table[place, 2] == z:
            return False
        place = (place + 1) & mask
    table[place, 0], table[place, 1], table[place, 2] = x, y, z
    return True
