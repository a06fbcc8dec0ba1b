"""Third step of a scan: what its marks do to the voxels. Log-odds up or down, clamped; the log of changes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from mapping.voxels.store import (
    ANY_MARK,
    EVER_HIT,
    EXPLAINED,
    HIT,
    IN_BLOCK,
    KNOWN,
    LISTED,
    MISS,
    N_EXPLAINED,
    N_KNOWN,
    N_OCCUPIED,
    N_REFUSED,
    N_TOUCHED,
    OCCUPIED,
    REVISION,
    SIDE,
    SIDE_BITS,
    UNEXPLAINED_HIT,
    VOXELS,
    find_or_make,
)

MARKS = MISS | HIT | UNEXPLAINED_HIT | LISTED


class Model(NamedTuple):
    """Log-odds in float32, as OctoMap keeps them."""

    hit: np.float32
    miss: np.float32
    lowest: np.float32
    highest: np.float32
    occupied: np.float32
    """Occupied ABOVE it."""


@njit(cache=True, nogil=True)
def put(store, block, voxel, log_odds, flags, occupied_above):
    """Gives one voxel its new state; counts, and logs it when that changes anything."""
    old = store.flags[block, voxel] & ~MARKS
    flags = (flags & ~(MARKS | OCCUPIED)) | KNOWN
    if log_odds > occupied_above:
        flags |= OCCUPIED
    same = flags == old and store.log_odds[block, voxel] == log_odds
    store.flags[block, voxel] = flags
    if same:
        return
    store.log_odds[block, voxel] = log_odds
    counts = store.counts
    counts[N_KNOWN] += (flags & KNOWN) - (old & KNOWN)
    more = ((flags & OCCUPIED) - (old & OCCUPIED)) // OCCUPIED
    counts[N_OCCUPIED] += more
    store.occupied[block] += more
    both = OCCUPIED | EXPLAINED
    counts[N_EXPLAINED] += int(flags & both == both) - int(old & both == both)
    store.log[counts[REVISION] & (store.log.size - 1)] = block * VOXELS + voxel
    counts[REVISION] += 1


@njit(cache=True, nogil=True)
def apply_mark(store, model, block, voxel, mark):
    """One voxel, once per scan: a hit where any point lay in it, else a miss.

    A voxel counts as explained when the scan that hit it first had nothing but explained points in it, until an
    unexplained point hits it.
    """
    flags = store.flags[block, voxel]
    if mark & HIT:
        log_odds = min(store.log_odds[block, voxel] + model.hit, model.highest)
        if mark & UNEXPLAINED_HIT:
            flags &= ~EXPLAINED
        elif not flags & EVER_HIT:
            flags |= EXPLAINED
        put(store, block, voxel, log_odds, flags | EVER_HIT, model.occupied)
    else:
        log_odds = max(store.log_odds[block, voxel] + model.miss, model.lowest)
        put(store, block, voxel, log_odds, flags, model.occupied)


@njit(cache=True, nogil=True)
def apply_blocks(store, model):
    """Third step of a scan without a grid: the marks in the map's blocks, which are gone then."""
    words = store.flags.view(np.uint64)
    for n in range(store.counts[N_TOUCHED]):
        block = store.touched[n]
        for w in range(VOXELS // 8):
            if words[block, w] & np.uint64(ANY_MARK) == 0:
                continue
            for voxel in range(8 * w, 8 * w + 8):
                mark = store.flags[block, voxel] & MARKS
                if mark:
                    apply_mark(store, model, block, voxel, mark)


@njit(cache=True, nogil=True)
def apply_grid(store, model, grid, reached):
    """Third step of a scan: the marks in the grid, which is all zeros then.

    ``reached`` (2, 3) are the lowest and the highest key with a mark. Voxels without room are counted.
    """
    words = grid.marks.view(np.uint64)
    row = grid.side >> SIDE_BITS
    for bz in range(reached[0, 2] >> SIDE_BITS, (reached[1, 2] >> SIDE_BITS) + 1):
        for by in range(reached[0, 1] >> SIDE_BITS, (reached[1, 1] >> SIDE_BITS) + 1):
            y, z = (by << SIDE_BITS) - grid.y0, (bz << SIDE_BITS) - grid.z0
            for bx in range(reached[0, 0] >> SIDE_BITS, (reached[1, 0] >> SIDE_BITS) + 1):
                first = (z * grid.side + y) * row + bx - (grid.x0 >> SIDE_BITS)
                block = -2
                for r in range(SIDE * SIDE):
                    word = first + ((r >> SIDE_BITS) * grid.side + (r & IN_BLOCK)) * row
                    if words[word] == 0:
                        continue
                    if block == -2:
                        block = find_or_make(store, bx, by, bz)
                    for i in range(SIDE):
                        mark = grid.marks[word * SIDE + i]
                        if mark == 0:
                            continue
                        if block >= 0:
                            apply_mark(store, model, block, r * SIDE + i, mark)
                        else:
                            store.counts[N_REFUSED] += 1
                    words[word] = 0


@njit(cache=True, nogil=True)
def assign(store, model, points, occupied, resolution):
    """Sets the voxels of ``points`` to the highest or the lowest log-odds; those without room are counted."""
    scale = 1.0 / resolution
    for i in range(points.shape[0]):
        x, y, z = math.floor(points[i, 0] * scale), math.floor(points[i, 1] * scale), math.floor(points[i, 2] * scale)
        block = find_or_make(store, x >> SIDE_BITS, y >> SIDE_BITS, z >> SIDE_BITS)
        if block < 0:
            store.counts[N_REFUSED] += 1
            continue
        voxel = (z & IN_BLOCK) << 6 | (y & IN_BLOCK) << 3 | (x & IN_BLOCK)
        flags = store.flags[block, voxel]
        if occupied[i]:
            put(store, block, voxel, model.highest, (flags & ~EXPLAINED) | EVER_HIT, model.occupied)
        else:
            put(store, block, voxel, model.lowest, flags, model.occupied)


@njit(cache=True, nogil=True)
def mark_explained(store, model, numbers, explained):
    """The voxels of these numbers (N,), -1: none, become explained or not."""
    for i in range(numbers.size):
        if numbers[i] < 0:
            continue
        block, voxel = numbers[i] // VOXELS, numbers[i] % VOXELS
        flags = store.flags[block, voxel] & ~EXPLAINED
        if explained[i]:
            flags |= EXPLAINED
        put(store, block, voxel, store.log_odds[block, voxel], flags, model.occupied)
