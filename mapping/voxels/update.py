"""Third step of a scan: what its marks do to the voxels. Log-odds up or down, clamped; the log of changes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from mapping.voxels.blocks import find_or_make, left_bytes, make_brick, place_in, place_of, voxel_in
from mapping.voxels.marks import HIT_WORDS, UNEXPLAINED_WORDS
from mapping.voxels.store import (
    BRICK,
    BRICK_BITS,
    BRICKS,
    CELL_EVER_HIT,
    CELL_EXPLAINED,
    CELL_TRUTHS,
    CHUNK,
    CHUNK_BITS,
    HIT,
    KNOWN,
    LOG_MASK,
    MISS,
    N_EXPLAINED,
    N_KNOWN,
    N_OCCUPIED,
    N_REFUSED,
    N_TOUCHED,
    N_VALUES,
    OCCUPIED,
    REVISION,
    SIDE_BITS,
    UNEXPLAINED_HIT,
    VALUE,
    VOXELS,
    WHOLE_BLOCK_BYTES,
)

EVERY_HIT = np.uint64(HIT * 0x0101010101010101)
"""Of the eight voxels in a word of a grid."""


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
def _number_after_hit(store, model, number):
    after = number_of(store, model, min(store.values[number] + model.hit, model.highest))
    store.after_hit[number] = after
    return after


@njit(cache=True, nogil=True)
def _number_after_miss(store, model, number):
    after = number_of(store, model, max(store.values[number] + model.miss, model.lowest))
    if after == number and store.values[number] > model.lowest:
        after = _next_lower(store, number)
    store.after_miss[number] = after
    return after


@njit(cache=True, nogil=True)
def _put(store, block, voxel, place, cell):
    """Gives the voxel whose cell is at ``place`` its new one; counts, and logs it when that changes anything."""
    old = np.int64(store.cells[place])
    if cell == old:
        return
    store.cells[place] = cell
    counts = store.counts
    was, now = np.int64(store.kinds[old & VALUE]), np.int64(store.kinds[cell & VALUE])
    counts[N_KNOWN] += (now & KNOWN) - (was & KNOWN)
    more = ((now & OCCUPIED) - (was & OCCUPIED)) // OCCUPIED
    counts[N_OCCUPIED] += more
    store.occupied[block] += more
    counts[N_EXPLAINED] += _both(now, cell) - _both(was, old)
    at = counts[REVISION] & counts[LOG_MASK]
    store.log[at] = block * BRICKS + (voxel >> BRICK_BITS)
    store.log_voxels[at] = 1 << (voxel & BRICK - 1)
    counts[REVISION] += 1


@njit(cache=True, nogil=True, inline="always")
def _both(kind, cell):
    """1 where a voxel is occupied and explained."""
    return (kind & OCCUPIED) // OCCUPIED & (cell & CELL_EXPLAINED) // CELL_EXPLAINED


@njit(cache=True, nogil=True)
def _apply_block(store, model, block, words, begin):
    """A block's marks, a word for each brick from ``begin`` on, a byte for each voxel; they are zeros then.

    Each voxel once per scan: a hit where any point lay in it, else a miss. A voxel counts as explained when the scan
    that hit it first had nothing but explained points in it, until an unexplained point hits it. Voxels without room
    are counted. What ``_put`` and ``make_brick`` do is written out here: a call with all arrays of a map takes longer.
    """
    cells, bricks, chunks, kinds = store.cells, store.bricks, store.chunks, store.kinds
    after_hit, after_miss, counts = store.after_hit, store.after_miss, store.counts
    revision, ring = counts[REVISION], counts[LOG_MASK]
    known, occupied, explained = 0, 0, 0
    for brick in range(BRICKS):
        word = words[begin + brick]
        if word == 0:
            continue
        words[begin + brick] = 0
        slot = np.int64(bricks[block, brick]) if block >= 0 else 0
        if slot == 0 and block >= 0:
            filled = np.int64(store.filled[block])
            if filled == 0 or filled & (CHUNK - 1) != 0:
                slot = filled + 1
                store.filled[block] = slot
                bricks[block, brick] = slot
            else:
                slot = make_brick(store, block, brick)
        if slot == 0:
            for i in range(BRICK):
                counts[N_REFUSED] += int(word >> np.uint64(8 * i) & np.uint64(0xFF) != 0)
            continue
        first = place_in(chunks[block, (slot - 1) >> CHUNK_BITS], slot)
        changed = 0
        for i in range(BRICK):
            mark = np.int64(word >> np.uint64(8 * i) & np.uint64(0xFF))
            if mark == 0:
                continue
            old = np.int64(cells[first + i])
            number, truths = old & VALUE, old & CELL_TRUTHS
            if mark & HIT:
                after = np.int64(after_hit[number])
                if after == 0:
                    after = _number_after_hit(store, model, number)
                if mark & UNEXPLAINED_HIT:
                    truths &= ~CELL_EXPLAINED
                elif not truths & CELL_EVER_HIT:
                    truths |= CELL_EXPLAINED
                truths |= CELL_EVER_HIT
            else:
                after = np.int64(after_miss[number])
                if after == 0:
                    after = _number_after_miss(store, model, number)
            cell = after | truths
            if cell == old:
                continue
            cells[first + i] = cell
            changed |= 1 << i
            was, now = np.int64(kinds[number]), np.int64(kinds[after])
            known += (now & KNOWN) - (was & KNOWN)
            occupied += (now & OCCUPIED) - (was & OCCUPIED)
            explained += _both(now, cell) - _both(was, old)
        if changed:
            store.log[revision & ring] = block * BRICKS + brick
            store.log_voxels[revision & ring] = changed
            revision += 1
    if block >= 0:
        store.occupied[block] += occupied // OCCUPIED
    counts[N_KNOWN] += known
    counts[N_OCCUPIED] += occupied // OCCUPIED
    counts[N_EXPLAINED] += explained
    counts[REVISION] = revision


@njit(cache=True, nogil=True)
def apply_blocks(store, model):
    """Third step of a scan without a grid: the marks in the blocks' pages, which are zeros then."""
    marks, pages = np.zeros(BRICKS, np.uint64), store.marks
    for page in range(store.counts[N_TOUCHED]):
        for brick in range(BRICKS):
            word, shift = brick // 8, np.uint64(brick % 8 * 8)
            misses = _spread(pages[page, word] >> shift)
            hits = _spread(pages[page, HIT_WORDS + word] >> shift)
            unexplained = _spread(pages[page, UNEXPLAINED_WORDS + word] >> shift)
            marks[brick] = misses * np.uint64(MISS) | hits * np.uint64(HIT) | unexplained * np.uint64(UNEXPLAINED_HIT)
        pages[page, :] = 0
        _apply_block(store, model, store.touched[page], marks, 0)


@njit(cache=True, nogil=True, inline="always")
def _spread(bits):
    """The eight lowest bits as eight bytes of 0 or 1, lowest first."""
    seven = (bits & np.uint64(0x7F)) * np.uint64(0x0002040810204081) & np.uint64(0x0101010101010101)
    return seven | (bits >> np.uint64(7) & np.uint64(1)) << np.uint64(56)


@njit(cache=True, nogil=True)
def apply_grid(store, model, grid):
    """Third step of a scan: the marks in the grid, which is all zeros then. Voxels without room are counted."""
    words, flags = grid.marks.view(np.uint64), grid.touched.view(np.uint64)
    if left_bytes(store) < _count_touched(flags) * WHOLE_BLOCK_BYTES:
        _make_room_for_hits(store, grid)
    blocks_x, blocks_y = grid.at_x.size >> SIDE_BITS, grid.at_y.size >> SIDE_BITS
    for eight in range(flags.size):
        flag = flags[eight]
        if flag == 0:
            continue
        flags[eight] = 0
        for n in range(8):
            if flag >> np.uint64(8 * n) & np.uint64(1):
                bx, by, bz = _block_key(grid, blocks_x, blocks_y, 8 * eight + n)
                _apply_block(store, model, find_or_make(store, bx, by, bz), words, (8 * eight + n) * BRICKS)


@njit(cache=True, nogil=True)
def _count_touched(flags):
    count = 0
    for eight in range(flags.size):
        count += np.int64(flags[eight] * np.uint64(0x0101010101010101) >> np.uint64(56))
    return count


@njit(cache=True, nogil=True, inline="always")
def _block_key(grid, blocks_x, blocks_y, number):
    """Of a block of the grid, by its number there."""
    row = number // blocks_x
    return (
        (grid.x0 >> SIDE_BITS) + number - row * blocks_x,
        (grid.y0 >> SIDE_BITS) + row % blocks_y,
        (grid.z0 >> SIDE_BITS) + row // blocks_y,
    )


@njit(cache=True, nogil=True)
def _make_room_for_hits(store, grid):
    """Makes the bricks with hits: of a map's last room they come first."""
    words, touched = grid.marks.view(np.uint64), grid.touched
    blocks_x, blocks_y = grid.at_x.size >> SIDE_BITS, grid.at_y.size >> SIDE_BITS
    for number in range(touched.size):
        if touched[number] == 0:
            continue
        block = -1
        for brick in range(BRICKS):
            if words[number * BRICKS + brick] & EVERY_HIT == 0:
                continue
            if block < 0:
                bx, by, bz = _block_key(grid, blocks_x, blocks_y, number)
                block = find_or_make(store, bx, by, bz)
            if block >= 0:
                make_brick(store, block, brick)


@njit(cache=True, nogil=True)
def make_room_for_hits(store):
    """Makes the bricks with hits in the blocks' pages, before rays take a map's last room for more blocks."""
    for page in range(store.counts[N_TOUCHED]):
        for brick in range(BRICKS):
            word, shift = HIT_WORDS + brick // 8, np.uint64(brick % 8 * 8)
            if store.marks[page, word] >> shift & np.uint64(0xFF) != 0:
                make_brick(store, store.touched[page], brick)


@njit(cache=True, nogil=True)
def assign(store, model, points, occupied, resolution):
    """Sets the voxels of ``points`` to the highest or the lowest log-odds; those without room are counted."""
    scale = 1.0 / resolution
    highest, lowest = number_of(store, model, model.highest), number_of(store, model, model.lowest)
    for i in range(points.shape[0]):
        x, y, z = math.floor(points[i, 0] * scale), math.floor(points[i, 1] * scale), math.floor(points[i, 2] * scale)
        block, voxel = find_or_make(store, x >> SIDE_BITS, y >> SIDE_BITS, z >> SIDE_BITS), voxel_in(x, y, z)
        if block < 0 or make_brick(store, block, voxel >> BRICK_BITS) == 0:
            store.counts[N_REFUSED] += 1
            continue
        place = place_of(store, block, voxel)
        truths = np.int64(store.cells[place]) & CELL_TRUTHS
        if occupied[i]:
            _put(store, block, voxel, place, highest | (truths & ~CELL_EXPLAINED) | CELL_EVER_HIT)
        else:
            _put(store, block, voxel, place, lowest | truths)


@njit(cache=True, nogil=True)
def mark_explained(store, numbers, explained):
    """The voxels of these numbers (N,), -1: none, become explained or not."""
    for i in range(numbers.size):
        if numbers[i] < 0:
            continue
        block, voxel = numbers[i] // VOXELS, numbers[i] % VOXELS
        place = place_of(store, block, voxel)
        cell = np.int64(store.cells[place]) & ~CELL_EXPLAINED
        _put(store, block, voxel, place, cell | CELL_EXPLAINED if explained[i] else cell)
