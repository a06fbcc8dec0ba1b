"""The blocks of a map: where they lie in memory, how they are found, how new ones are made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapping.errors import CapacityError
from mapping.geometry.arrays import F32, I32, I64, U8, U16, U32

SIDE_BITS = 3
SIDE = 1 << SIDE_BITS
IN_BLOCK = SIDE - 1
VOXELS = SIDE**3

# What a voxel's cell holds: the number of its log-odds in ``Store.values`` (0: never seen), and three truths.
VALUE = 0x1FFF
CELL_LISTED, CELL_EXPLAINED, CELL_EVER_HIT = 0x2000, 0x4000, 0x8000
"""The first one only while a list of changes is made."""
CELL_TRUTHS = CELL_EXPLAINED | CELL_EVER_HIT

# The state of a voxel, as ``state_of`` tells it.
KNOWN, OCCUPIED, EXPLAINED, EVER_HIT = 1, 2, 4, 8

# What a scan does to a voxel.
MISS, HIT, UNEXPLAINED_HIT = 1, 2, 4

# Places in ``Store.counts``.
N_BLOCKS, N_KNOWN, N_OCCUPIED, N_EXPLAINED, REVISION, N_TOUCHED, SCAN, N_REFUSED, N_EVER_USED = range(9)
N_VALUES, N_PAGES, TABLE_FIRST, LOG_MASK, LOG_FROM = range(9, 14)

MAX_BLOCKS = 1 << 23
"""A voxel's number in the log of changes has 32 bits."""
MAX_LOG, MIN_LOG = 1 << 22, 1 << 10
FIRST_LOG = 1 << 18
"""It grows with the map, so that a small one has no long one."""
FIRST_TABLE = 1 << 10
BLOCK_BYTES = VOXELS * 2 + 28
"""Of one block in all arrays but the table and the pages of marks."""
MOST_BLOCK_BYTES = BLOCK_BYTES + VOXELS + 32
"""With a page of marks and the table."""
VALUE_BYTES = 9


class Store(NamedTuple):
    """Arrays of one map, made once for all blocks it may ever hold: the system gives memory only as they fill.

    Nothing that is found is ever moved, so that another thread may look things up while a scan is put in. Voxels share
    their log-odds: hits and misses come in two sizes and end at the clamps, so that there are few different ones, and a
    cell needs two bytes for exactly what OctoMap keeps in four. Where more than 8,191 come up (not within an hour of
    scans by chance at 10 Hz), the next higher one of these stands for a new one.
    """

    table: I32
    """Tables of 2^n places one behind the other, the one in use begins at TABLE_FIRST and has as many places. Open
    addressing: block number + 1, 0 is free"""
    keys: I32
    """(blocks, 3) floor(enu / (8 * resolution))"""
    cells: U16
    """(blocks, 512) voxel (z & 7) * 64 + (y & 7) * 8 + (x & 7)"""
    values: F32
    """(8192,) different log-odds, in the order in which they came up; 0 is for voxels never seen"""
    kinds: U8
    """(8192,) KNOWN and OCCUPIED of these"""
    after_hit: U16
    """(8192,) number of the log-odds after one more hit; 0: not worked out yet"""
    after_miss: U16
    occupied: I32
    """(blocks,) how many of its voxels are"""
    stamp: I32
    """(blocks,) the last scan that touched it"""
    page: I32
    """(blocks,) where the marks of that scan are"""
    touched: I32
    """(blocks,) those that the scan being put in touches, by page"""
    marks: U8
    """(pages, 512) MISS, HIT, UNEXPLAINED_HIT of a scan without a grid; zeros between scans"""
    log: U32
    """Ring of LOG_MASK + 1 places: block * 512 + voxel of every change; revision r is written at r & LOG_MASK"""
    counts: I64


def blocks_that_fit(memory_limit_bytes: int) -> int:
    """How many blocks a map of so many bytes may hold, each with a page of marks and its share of the table."""
    return min(MAX_BLOCKS, (memory_limit_bytes - 4 * log_length(memory_limit_bytes)) // MOST_BLOCK_BYTES)


def log_length(memory_limit_bytes: int) -> int:
    """At most: a power of two; at most a sixteenth of the memory."""
    entries = max(MIN_LOG, min(MAX_LOG, memory_limit_bytes // 64))
    return 1 << (entries.bit_length() - 1)


def make_store(memory_limit_bytes: int) -> Store:
    """An empty store. Raises CapacityError when the system does not give the memory."""
    blocks = blocks_that_fit(memory_limit_bytes)
    longest_table, longest_log = 1 << (2 * blocks - 1).bit_length(), log_length(memory_limit_bytes)
    try:
        store = Store(
            table=np.zeros(2 * longest_table, np.int32),
            keys=np.zeros((blocks, 3), np.int32),
            cells=np.zeros((blocks, VOXELS), np.uint16),
            values=np.zeros(VALUE + 1, np.float32),
            kinds=np.zeros(VALUE + 1, np.uint8),
            after_hit=np.zeros(VALUE + 1, np.uint16),
            after_miss=np.zeros(VALUE + 1, np.uint16),
            occupied=np.zeros(blocks, np.int32),
            stamp=np.zeros(blocks, np.int32),
            page=np.zeros(blocks, np.int32),
            touched=np.zeros(blocks, np.int32),
            marks=np.zeros((blocks, VOXELS), np.uint8),
            log=np.zeros(longest_log, np.uint32),
            counts=np.zeros(14, np.int64),
        )
    except MemoryError:
        raise CapacityError(
            f"This computer does not give {memory_limit_bytes / 1e6:,.0f} MB for a map.",
            where="memory_limit_bytes",
            advice="Set a smaller limit.",
        ) from None
    store.counts[N_VALUES] = 1
    store.counts[TABLE_FIRST] = min(FIRST_TABLE, longest_table)
    store.counts[LOG_MASK] = min(FIRST_LOG, longest_log) - 1
    return store


def used_bytes(store: Store) -> int:
    """Memory that has been filled, not what is set aside."""
    counts = store.counts.tolist()
    table = 4 * (2 * counts[TABLE_FIRST] - min(FIRST_TABLE, counts[TABLE_FIRST]))
    logged = 4 * min(counts[REVISION], counts[LOG_MASK] + 1)
    blocks, pages = counts[N_EVER_USED] * BLOCK_BYTES, counts[N_PAGES] * VOXELS
    return blocks + pages + table + logged + counts[N_VALUES] * VALUE_BYTES


def logged_from(store: Store) -> int:
    """The first revision of which the change is still in the log."""
    return int(max(store.counts[LOG_FROM], store.counts[REVISION] - store.counts[LOG_MASK] - 1))


@njit(cache=True, nogil=True, inline="always")
def _home(bx, by, bz, mask):
    """Where the search in the table begins."""
    h = bx * 0x2545F4914F6CDD1D + by * 0x1B873593CC9E2D51 + bz * 0x369DEA0F31A53F85
    return (h ^ (h >> 29) ^ (h >> 47)) & mask


@njit(cache=True, nogil=True)
def find(store, bx, by, bz):
    """Number of the block; -1 where there is none."""
    first = store.counts[TABLE_FIRST]
    mask = first - 1
    place = _home(bx, by, bz, mask)
    while True:
        block = store.table[first + place] - 1
        if block < 0:
            return -1
        if store.keys[block, 0] == bx and store.keys[block, 1] == by and store.keys[block, 2] == bz:
            return block
        place = (place + 1) & mask


@njit(cache=True, nogil=True)
def _enter(store, first, block):
    """Into the table that begins at ``first``."""
    mask = first - 1
    place = _home(store.keys[block, 0], store.keys[block, 1], store.keys[block, 2], mask)
    while store.table[first + place] != 0:
        place = (place + 1) & mask
    store.table[first + place] = block + 1


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
        store.cells[block, :] = 0
        store.occupied[block] = 0
    else:
        counts[N_EVER_USED] = block + 1
    store.keys[block, 0], store.keys[block, 1], store.keys[block, 2] = bx, by, bz
    store.stamp[block] = 0
    first = counts[TABLE_FIRST]
    if 2 * (block + 1) > first and 4 * first <= store.table.size:
        # Whoever searches the old one meanwhile still finds in it what was there.
        for old in range(block):
            _enter(store, 2 * first, old)
        _enter(store, 2 * first, block)
        counts[TABLE_FIRST] = 2 * first
    else:
        _enter(store, first, block)
    counts[N_BLOCKS] = block + 1
    return block


@njit(cache=True, nogil=True)
def touch(store, bx, by, bz):
    """The page for the marks of a block, which is made where it is not there yet; -1 where the memory is full."""
    block = find_or_make(store, bx, by, bz)
    if block < 0:
        return -1
    counts = store.counts
    if store.stamp[block] != counts[SCAN]:
        store.stamp[block] = counts[SCAN]
        store.page[block] = counts[N_TOUCHED]
        store.touched[counts[N_TOUCHED]] = block
        counts[N_TOUCHED] += 1
        counts[N_PAGES] = max(counts[N_PAGES], counts[N_TOUCHED])
    return store.page[block]


@njit(cache=True, nogil=True)
def begin_scan(store):
    counts = store.counts
    counts[SCAN] += 1
    counts[N_TOUCHED] = 0
    length = counts[LOG_MASK] + 1
    if counts[N_KNOWN] <= 4 * length or 2 * length > store.log.size:
        return
    oldest = max(counts[LOG_FROM], counts[REVISION] - length)
    for revision in range(oldest, counts[REVISION]):
        if revision & length:
            store.log[length + (revision & (length - 1))] = store.log[revision & (length - 1)]
    counts[LOG_FROM] = oldest
    counts[LOG_MASK] = 2 * length - 1


@njit(cache=True, nogil=True, inline="always")
def state_of(store, block, voxel):
    """KNOWN, OCCUPIED, EXPLAINED and EVER_HIT of a voxel."""
    cell = store.cells[block, voxel]
    return store.kinds[cell & VALUE] | (cell >> 12) & (EXPLAINED | EVER_HIT)


@njit(cache=True, nogil=True)
def empty(store):
    """Forgets every block; what it cost in memory stays for those to come."""
    counts = store.counts
    first = counts[TABLE_FIRST]
    mask = first - 1
    for block in range(counts[N_BLOCKS]):
        place = _home(store.keys[block, 0], store.keys[block, 1], store.keys[block, 2], mask)
        while store.table[first + place] != 0:
            store.table[first + place] = 0
            place = (place + 1) & mask
    counts[N_BLOCKS] = 0
    counts[N_KNOWN] = 0
    counts[N_OCCUPIED] = 0
    counts[N_EXPLAINED] = 0
    counts[N_REFUSED] = 0
    counts[REVISION] += 1
