"""Third step of a scan: what its marks do to the voxels. Log-odds up or down, clamped; the log of changes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from mapping.voxels.store import (
    CELL_EVER_HIT,
    CELL_EXPLAINED,
    CELL_TRUTHS,
    HIT,
    IN_BLOCK,
    KNOWN,
    LOG_MASK,
    N_EXPLAINED,
    N_KNOWN,
    N_OCCUPIED,
    N_REFUSED,
    N_TOUCHED,
    N_VALUES,
    OCCUPIED,
    REVISION,
    SIDE,
    SIDE_BITS,
    UNEXPLAINED_HIT,
    VALUE,
    VOXELS,
    find_or_make,
)


class Model(NamedTuple):
    """Log-odds in float32, as OctoMap keeps them."""

    hit: np.float32
    miss: np.float32
    lowest: np.float32
    highest: np.float32
    occupied: np.float32
    """Occupied ABOVE it."""


@njit(cache=True, nogil=True)
def number_of(store, model, log_odds):
    """Of these log-odds among the map's values. A map that has all it can tell apart takes the next higher ones."""
    counts = store.counts
    higher = 0  # the clamps came first: between them one is always there
    for n in range(1, counts[N_VALUES]):
        value = store.values[n]
        if value == log_odds:
            return n
        if value > log_odds and (higher == 0 or value < store.values[higher]):
            higher = n
    n = counts[N_VALUES]
    if n > VALUE:
        return higher
    store.values[n] = log_odds
    store.kinds[n] = KNOWN | OCCUPIED if log_odds > model.occupied else KNOWN
    counts[N_VALUES] = n + 1
    return n


@njit(cache=True, nogil=True)
def _next_lower(store, number):
    """For a miss smaller than what a full map can tell apart: it frees all the same."""
    lower = 0
    for n in range(1, store.counts[N_VALUES]):
        value = store.values[n]
        if value < store.values[number] and (lower == 0 or value > store.values[lower]):
            lower = n
    return lower


@njit(cache=True, nogil=True)
def begin_values(store, model):
    """The clamps are a map's first values."""
    number_of(store, model, model.highest)
    number_of(store, model, model.lowest)


@njit(cache=True, nogil=True)
def put(store, block, voxel, cell):
    """Gives one voxel its new cell; counts, and logs it when that changes anything."""
    old = np.int64(store.cells[block, voxel])
    if cell == old:
        return
    store.cells[block, voxel] = cell
    counts = store.counts
    was, now = np.int64(store.kinds[old & VALUE]), np.int64(store.kinds[cell & VALUE])
    counts[N_KNOWN] += (now & KNOWN) - (was & KNOWN)
    more = ((now & OCCUPIED) - (was & OCCUPIED)) // OCCUPIED
    counts[N_OCCUPIED] += more
    store.occupied[block] += more
    both_now = now & OCCUPIED != 0 and cell & CELL_EXPLAINED != 0
    both_before = was & OCCUPIED != 0 and old & CELL_EXPLAINED != 0
    counts[N_EXPLAINED] += int(both_now) - int(both_before)
    store.log[counts[REVISION] & counts[LOG_MASK]] = block * VOXELS + voxel
    counts[REVISION] += 1


@njit(cache=True, nogil=True)
def apply_mark(store, model, block, voxel, mark):
    """One voxel, once per scan: a hit where any point lay in it, else a miss.

    A voxel counts as explained when the scan that hit it first had nothing but explained points in it, until an
    unexplained point hits it.
    """
    cell = np.int64(store.cells[block, voxel])
    number, truths = cell & VALUE, cell & CELL_TRUTHS
    if mark & HIT:
        after = np.int64(store.after_hit[number])
        if after == 0:
            after = number_of(store, model, min(store.values[number] + model.hit, model.highest))
            store.after_hit[number] = after
        if mark & UNEXPLAINED_HIT:
            truths &= ~CELL_EXPLAINED
        elif not truths & CELL_EVER_HIT:
            truths |= CELL_EXPLAINED
        put(store, block, voxel, after | truths | CELL_EVER_HIT)
    else:
        after = np.int64(store.after_miss[number])
        if after == 0:
            after = number_of(store, model, max(store.values[number] + model.miss, model.lowest))
            if after == number and store.values[number] > model.lowest:
                after = _next_lower(store, number)
            store.after_miss[number] = after
        put(store, block, voxel, after | truths)


@njit(cache=True, nogil=True)
def apply_blocks(store, model):
    """Third step of a scan without a grid: the marks in the blocks' pages, which are zeros then."""
    words = store.marks.view(np.uint64)
    for page in range(store.counts[N_TOUCHED]):
        block = store.touched[page]
        for w in range(VOXELS // 8):
            if words[page, w] == 0:
                continue
            for voxel in range(8 * w, 8 * w + 8):
                mark = store.marks[page, voxel]
                if mark:
                    apply_mark(store, model, block, voxel, mark)
            words[page, w] = 0


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
    highest, lowest = number_of(store, model, model.highest), number_of(store, model, model.lowest)
    for i in range(points.shape[0]):
        x, y, z = math.floor(points[i, 0] * scale), math.floor(points[i, 1] * scale), math.floor(points[i, 2] * scale)
        block = find_or_make(store, x >> SIDE_BITS, y >> SIDE_BITS, z >> SIDE_BITS)
        if block < 0:
            store.counts[N_REFUSED] += 1
            continue
        voxel = (z & IN_BLOCK) << 6 | (y & IN_BLOCK) << 3 | (x & IN_BLOCK)
        truths = np.int64(store.cells[block, voxel]) & CELL_TRUTHS
        if occupied[i]:
            put(store, block, voxel, highest | (truths & ~CELL_EXPLAINED) | CELL_EVER_HIT)
        else:
            put(store, block, voxel, lowest | truths)


@njit(cache=True, nogil=True)
def mark_explained(store, numbers, explained):
    """The voxels of these numbers (N,), -1: none, become explained or not."""
    for i in range(numbers.size):
        if numbers[i] < 0:
            continue
        block, voxel = numbers[i] // VOXELS, numbers[i] % VOXELS
        cell = np.int64(store.cells[block, voxel]) & ~CELL_EXPLAINED
        put(store, block, voxel, cell | CELL_EXPLAINED if explained[i] else cell)
