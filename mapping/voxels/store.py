"""The blocks of a map: where they lie in memory, how they are found, how new ones are made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapping.errors import CapacityError
from mapping.geometry.arrays import F32, I32, I64, U8, U32

SIDE_BITS = 3
SIDE = 1 << SIDE_BITS
IN_BLOCK = SIDE - 1
VOXELS = SIDE**3

# What a voxel's byte holds. The last four stand only while a scan is put in or a list of changes is made.
KNOWN, OCCUPIED, EXPLAINED, EVER_HIT = 1, 2, 4, 8
MISS, HIT, UNEXPLAINED_HIT, LISTED = 16, 32, 64, 128
ANY_MARK = 0x70707070_70707070
"""MISS, HIT or UNEXPLAINED_HIT in eight voxels at once."""

# Places in ``Store.counts``.
N_BLOCKS, N_KNOWN, N_OCCUPIED, N_EXPLAINED, REVISION, N_TOUCHED, SCAN, N_REFUSED, N_EVER_USED = range(9)

MAX_BLOCKS = 1 << 23
"""A voxel's number in the log of changes has 32 bits."""
MAX_LOG, MIN_LOG = 1 << 22, 1 << 10
BLOCK_BYTES = VOXELS * 5 + 24
"""Of one block in all arrays but the table."""


class Store(NamedTuple):
    """Arrays of one map, made once for all blocks it may ever hold: the system gives memory only as they fill.

    Nothing is ever moved, so that another thread may look things up while a scan is put in.
    """

    table: I32
    """(power of two,) open addressing: block number + 1, 0 is free"""
    keys: I32
    """(blocks, 3) floor(enu / (8 * resolution))"""
    log_odds: F32
    """(blocks, 512) voxel (z & 7) * 64 + (y & 7) * 8 + (x & 7)"""
    flags: U8
    """(blocks, 512)"""
    occupied: I32
    """(blocks,) how many of its voxels are"""
    stamp: I32
    """(blocks,) the last scan that touched it"""
    touched: I32
    """(blocks,) those that the scan being put in touches"""
    log: U32
    """(power of two,) ring: block * 512 + voxel of every change; revision r is written at r modulo its length"""
    counts: I64


def blocks_that_fit(memory_limit_bytes: int) -> int:
    """How many blocks a map of so many bytes may hold, with their share of the table and the log."""
    return min(MAX_BLOCKS, (memory_limit_bytes - 4 * log_length(memory_limit_bytes)) // (BLOCK_BYTES + 16))


def log_length(memory_limit_bytes: int) -> int:
    """A power of two; at most a sixteenth of the memory."""
    entries = max(MIN_LOG, min(MAX_LOG, memory_limit_bytes // 64))
    return 1 << (entries.bit_length() - 1)


def make_store(memory_limit_bytes: int) -> Store:
    """An empty store. Raises CapacityError when the system does not give the memory."""
    blocks = blocks_that_fit(memory_limit_bytes)
    table_length = 1 << (2 * blocks - 1).bit_length()
    try:
        return Store(
            np.zeros(table_length, np.int32),
            np.zeros((blocks, 3), np.int32),
            np.zeros((blocks, VOXELS), np.float32),
            np.zeros((blocks, VOXELS), np.uint8),
            np.zeros(blocks, np.int32),
            np.zeros(blocks, np.int32),
            np.zeros(blocks, np.int32),
            np.zeros(log_length(memory_limit_bytes), np.uint32),
            np.zeros(9, np.int64),
        )
    except MemoryError:
        raise CapacityError(
            f"This computer does not give {memory_limit_bytes / 1e6:,.0f} MB for a map.",
            where="memory_limit_bytes",
            advice="Set a smaller limit.",
        ) from None


def used_bytes(store: Store) -> int:
    """Memory that has been filled, not what is set aside."""
    counts = store.counts
    logged = min(int(counts[REVISION]), len(store.log))
    return int(counts[N_EVER_USED]) * BLOCK_BYTES + store.table.nbytes + 4 * logged


@njit(cache=True, nogil=True, inline="always")
def _home(bx, by, bz, mask):
    """Where the search in the table begins."""
    h = bx * 0x2545F4914F6CDD1D + by * 0x1B873593CC9E2D51 + bz * 0x369DEA0F31A53F85
    return (h ^ (h >> 29) ^ (h >> 47)) & mask


@njit(cache=True, nogil=True)
def find(store, bx, by, bz):
    """Number of the block; -1 where there is none."""
    mask = store.table.size - 1
    place = _home(bx, by, bz, mask)
    while True:
        block = store.table[place] - 1
        if block < 0:
            return -1
        if store.keys[block, 0] == bx and store.keys[block, 1] == by and store.keys[block, 2] == bz:
            return block
        place = (place + 1) & mask


@njit(cache=True, nogil=True)
def find_or_make(store, bx, by, bz):
    """Number of the block; -1 where it would be a new one and the memory is full."""
    block = find(store, bx, by, bz)
    if block >= 0:
        return block
    counts = store.counts
    block = counts[N_BLOCKS]
    if block == store.keys.shape[0]:
        return -1
    if block < counts[N_EVER_USED]:
        store.log_odds[block, :] = 0.0
        store.flags[block, :] = 0
        store.occupied[block] = 0
    else:
        counts[N_EVER_USED] = block + 1
    store.keys[block, 0], store.keys[block, 1], store.keys[block, 2] = bx, by, bz
    store.stamp[block] = 0
    mask = store.table.size - 1
    place = _home(bx, by, bz, mask)
    while store.table[place] != 0:
        place = (place + 1) & mask
    store.table[place] = block + 1
    counts[N_BLOCKS] = block + 1
    return block


@njit(cache=True, nogil=True)
def touch(store, bx, by, bz):
    """As ``find_or_make``, and the block is on the list of those that this scan changes."""
    block = find_or_make(store, bx, by, bz)
    counts = store.counts
    if block >= 0 and store.stamp[block] != counts[SCAN]:
        store.stamp[block] = counts[SCAN]
        store.touched[counts[N_TOUCHED]] = block
        counts[N_TOUCHED] += 1
    return block


@njit(cache=True, nogil=True)
def begin_scan(store):
    store.counts[SCAN] += 1
    store.counts[N_TOUCHED] = 0


@njit(cache=True, nogil=True)
def empty(store):
    """Forgets every block; what it cost in memory stays for those to come."""
    counts = store.counts
    mask = store.table.size - 1
    for block in range(counts[N_BLOCKS]):
        place = _home(store.keys[block, 0], store.keys[block, 1], store.keys[block, 2], mask)
        while store.table[place] != 0:
            store.table[place] = 0
            place = (place + 1) & mask
    counts[N_BLOCKS] = 0
    counts[N_KNOWN] = 0
    counts[N_OCCUPIED] = 0
    counts[N_EXPLAINED] = 0
    counts[N_REFUSED] = 0
    counts[REVISION] += 1
