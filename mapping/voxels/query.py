"""Looking things up in a map's blocks: voxels by key, everything occupied, everything changed."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from mapping.voxels.blocks import find, place_in, place_of, state_of, voxel_in
from mapping.voxels.marks import LARGEST_KEY
from mapping.voxels.store import (
    BRICK,
    BRICK_BITS,
    BRICKS,
    CELL_EVER_HIT,
    CELL_EXPLAINED,
    CELL_LISTED,
    CHUNK_BITS,
    LOG_MASK,
    N_BLOCKS,
    OCCUPIED,
    REVISION,
    SIDE_BITS,
    VALUE,
    VOXELS,
)


@njit(cache=True, nogil=True)
def voxels_of(store, points, resolution):
    """(N,) number of the voxel that each of ``points`` (N, 3) lies in, block * 512 + voxel; -1 where none is known."""
    scale = 1.0 / resolution
    found = np.full(points.shape[0], -1, np.int64)
    last_x, last_y, last_z, block = LARGEST_KEY, 0, 0, -1
    for i in range(points.shape[0]):
        fx, fy, fz = points[i, 0] * scale, points[i, 1] * scale, points[i, 2] * scale
        if not (abs(fx) < LARGEST_KEY and abs(fy) < LARGEST_KEY and abs(fz) < LARGEST_KEY):
            continue
        x, y, z = math.floor(fx), math.floor(fy), math.floor(fz)
        bx, by, bz = x >> SIDE_BITS, y >> SIDE_BITS, z >> SIDE_BITS
        if bx != last_x or by != last_y or bz != last_z:
            block = find(store, bx, by, bz)
            last_x, last_y, last_z = bx, by, bz
        if block >= 0:
            voxel = voxel_in(x, y, z)
            place = place_of(store, block, voxel)
            if place >= 0 and store.cells[place] & VALUE:
                found[i] = block * VOXELS + voxel
    return found


@njit(cache=True, nogil=True)
def list_voxels(store, mask, value):
    """(N,) numbers of all voxels whose state under ``mask`` is ``value``."""
    found = np.empty(_list_voxels(store, mask, value, np.empty(0, np.int64)), np.int64)
    return found[: _list_voxels(store, mask, value, found)]


@njit(cache=True, nogil=True)
def _list_voxels(store, mask, value, found):
    """How many there are; as many as find room are written into ``found``."""
    cells, bricks, chunks, kinds, occupied = store.cells, store.bricks, store.chunks, store.kinds, store.occupied
    n = 0
    only_occupied = value & OCCUPIED != 0
    for block in range(store.counts[N_BLOCKS]):
        if only_occupied and occupied[block] == 0:
            continue
        for brick in range(BRICKS):
            slot = np.int64(bricks[block, brick])
            if slot == 0:
                continue
            first = place_in(chunks[block, (slot - 1) >> CHUNK_BITS], slot)
            for i in range(BRICK):
                if state_of(kinds, np.int64(cells[first + i])) & mask == value:
                    if n < found.size:
                        found[n] = block * VOXELS + brick * BRICK + i
                    n += 1
    return n


@njit(cache=True, nogil=True)
def list_changes(store, revision, ever_hit_only):
    """(N,) numbers of the voxels that the log holds since ``revision``, each once, the newest change first."""
    now, ring, most = store.counts[REVISION], store.counts[LOG_MASK], 0
    for r in range(revision, now):
        for i in range(BRICK):
            most += store.log_voxels[r & ring] >> i & 1
    found = np.empty(most, np.int64)
    n = 0
    for r in range(now - 1, revision - 1, -1):
        first = np.int64(store.log[r & ring]) << BRICK_BITS
        changed = np.int64(store.log_voxels[r & ring])
        place = place_of(store, first // VOXELS, first % VOXELS)
        for i in range(BRICK):
            cell = store.cells[place + i]
            if changed >> i & 1 == 0 or cell & CELL_LISTED or (ever_hit_only and not cell & CELL_EVER_HIT):
                continue
            store.cells[place + i] = cell | CELL_LISTED
            found[n] = first + i
            n += 1
    for i in range(n):
        store.cells[place_of(store, found[i] // VOXELS, found[i] % VOXELS)] &= np.uint16(0xFFFF ^ CELL_LISTED)
    return found[:n]


@njit(cache=True, nogil=True)
def describe(store, numbers):
    """Keys (N, 3) int32, log-odds (N,) and explained (N,) of voxels by number."""
    keys = np.empty((numbers.size, 3), np.int32)
    log_odds = np.empty(numbers.size, np.float32)
    explained = np.empty(numbers.size, np.bool_)
    for i in range(numbers.size):
        block, voxel = numbers[i] // VOXELS, numbers[i] % VOXELS
        keys[i, 0] = store.keys[block, 0] * 8 + (voxel >> 2 & 6 | voxel & 1)
        keys[i, 1] = store.keys[block, 1] * 8 + (voxel >> 4 & 6 | voxel >> 1 & 1)
        keys[i, 2] = store.keys[block, 2] * 8 + (voxel >> 6 & 6 | voxel >> 2 & 1)
        place = place_of(store, block, voxel)
        cell = np.int64(store.cells[place]) if place >= 0 else 0
        log_odds[i] = store.values[cell & VALUE]
        explained[i] = cell & CELL_EXPLAINED != 0
    return keys, log_odds, explained
