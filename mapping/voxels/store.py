"""The arrays of a map: where its blocks, their bricks and what is known of voxels lie in memory, and what they take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mapping.errors import CapacityError
from mapping.geometry.arrays import F32, I32, I64, U8, U16, U32, U64

SIDE_BITS = 3
SIDE = 1 << SIDE_BITS
VOXELS = SIDE**3
"""Of a block."""
BRICK_BITS = 3
BRICK = 1 << BRICK_BITS
"""Voxels of a brick, 2 x 2 x 2."""
BRICKS = VOXELS // BRICK
CHUNK_BITS = 3
CHUNK = 1 << CHUNK_BITS
"""Bricks that a block gets room for at a time."""
PLACES = CHUNK * BRICK

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
N_CHUNKS, N_CHUNKS_EVER_USED, N_ENTERED, LIMIT_BYTES = range(14, 18)

MAX_BLOCKS = 1 << 23
"""4.3 thousand million voxels; a brick's number in the log of changes, 64 to a block, has 32 bits."""
MAX_LOG, MIN_LOG = 1 << 21, 1 << 9
FIRST_LOG = 1 << 13
"""It grows with the map, so that a small one has no long one."""
VOXELS_LOGGED = 4
"""Known voxels for each place of the log, at most, once it has grown."""
LOG_BYTES = 5
"""Of one place."""
FIRST_TABLE = 1 << 10
BLOCK_BYTES = BRICKS + 4 * (BRICKS // CHUNK) + 29
"""Of one block in all arrays but the table, the pages of marks and the chunks with its voxels."""
PAGE_WORDS = 3 * VOXELS // 64
MOST_BLOCK_BYTES = BLOCK_BYTES + 8 * PAGE_WORDS + 32
"""With a page of marks and the table."""
CHUNK_BYTES = 2 * PLACES
WHOLE_BLOCK_BYTES = MOST_BLOCK_BYTES + BRICKS // CHUNK * CHUNK_BYTES
VALUE_BYTES = 9
ENTERED_AT_ONCE = 4
"""Blocks that come into a larger table with each new one: it is in use before the old one is two thirds full."""


class Store(NamedTuple):
    """Arrays of one map, made once for all it may ever hold: the system gives memory only as they fill.

    A block has room only for bricks in which anything is known: of what a laser's rays pass through in the open that
    is a third. Bricks come to a block in chunks of eight, in the order in which they become known; voxels are numbered
    brick by brick (``voxel_in``).

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
    """(chunks * 64,) eight voxels for each of the eight bricks of a chunk"""
    bricks: U8
    """(blocks, 64) which of its block's bricks in ``cells`` each one is, from 1; 0: nothing is known in it"""
    chunks: I32
    """(blocks, 8) where they are: the first eight, the next eight and so on"""
    filled: U8
    """(blocks,) how many bricks it has"""
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
    marks: U64
    """(pages, 24) a bit for each voxel of a scan without a grid: 8 words MISS, 8 HIT, 8 UNEXPLAINED_HIT; zeros between
    scans"""
    log: U32
    """Ring of LOG_MASK + 1 places: block * 64 + brick of every change; revision r is written at r & LOG_MASK"""
    log_voxels: U8
    """Beside it, a bit for each voxel of the brick that changed then"""
    counts: I64


def blocks_that_fit(memory_limit_bytes: int) -> int:
    """How many blocks a map of so many bytes may hold, each with a page of marks, one chunk, its share of the table."""
    return min(MAX_BLOCKS, room_bytes(memory_limit_bytes) // (MOST_BLOCK_BYTES + CHUNK_BYTES))


def room_bytes(memory_limit_bytes: int) -> int:
    """For blocks and chunks; the different log-odds, 74 kB where a map has all it can tell apart, come on top."""
    return memory_limit_bytes - LOG_BYTES * log_length(memory_limit_bytes)


def log_length(memory_limit_bytes: int) -> int:
    """At most: a power of two; at most a thirty-second of the memory."""
    entries = max(MIN_LOG, min(MAX_LOG, memory_limit_bytes // (32 * LOG_BYTES)))
    return 1 << (entries.bit_length() - 1)


def make_store(memory_limit_bytes: int) -> Store:
    """An empty store. Raises CapacityError when the system does not give the memory."""
    blocks, room = blocks_that_fit(memory_limit_bytes), room_bytes(memory_limit_bytes)
    chunks = min(room // CHUNK_BYTES, blocks * (BRICKS // CHUNK))
    longest_table, longest_log = 1 << (2 * blocks - 1).bit_length(), log_length(memory_limit_bytes)
    try:
        store = Store(
            table=np.zeros(2 * longest_table, np.int32),
            keys=np.zeros((blocks, 3), np.int32),
            cells=np.zeros(chunks * PLACES, np.uint16),
            bricks=np.zeros((blocks, BRICKS), np.uint8),
            chunks=np.zeros((blocks, BRICKS // CHUNK), np.int32),
            filled=np.zeros(blocks, np.uint8),
            values=np.zeros(VALUE + 1, np.float32),
            kinds=np.zeros(VALUE + 1, np.uint8),
            after_hit=np.zeros(VALUE + 1, np.uint16),
            after_miss=np.zeros(VALUE + 1, np.uint16),
            occupied=np.zeros(blocks, np.int32),
            stamp=np.zeros(blocks, np.int32),
            page=np.zeros(blocks, np.int32),
            touched=np.zeros(blocks, np.int32),
            marks=np.zeros((blocks, PAGE_WORDS), np.uint64),
            log=np.zeros(longest_log, np.uint32),
            log_voxels=np.zeros(longest_log, np.uint8),
            counts=np.zeros(18, np.int64),
        )
    except MemoryError:
        raise CapacityError(
            f"This computer does not give {memory_limit_bytes / 1e6:,.0f} MB for a map.",
            where="memory_limit_bytes",
            advice="Set a smaller limit.",
        ) from None
    store.counts[N_VALUES] = 1
    store.counts[LIMIT_BYTES] = room
    store.counts[TABLE_FIRST] = min(FIRST_TABLE, longest_table)
    store.counts[LOG_MASK] = min(FIRST_LOG, longest_log) - 1
    return store


def used_bytes(store: Store) -> int:
    """Memory that has been filled, not what is set aside."""
    counts = store.counts.tolist()
    first = counts[TABLE_FIRST] * (2 if counts[N_ENTERED] else 1)
    table = 4 * (2 * first - min(FIRST_TABLE, first))
    logged = LOG_BYTES * min(counts[REVISION], counts[LOG_MASK] + 1)
    blocks, pages = counts[N_EVER_USED] * BLOCK_BYTES, counts[N_PAGES] * 8 * PAGE_WORDS
    chunks = counts[N_CHUNKS_EVER_USED] * CHUNK_BYTES
    return blocks + pages + chunks + table + logged + counts[N_VALUES] * VALUE_BYTES


def logged_from(store: Store) -> int:
    """The first revision of which the change is still in the log."""
    return int(max(store.counts[LOG_FROM], store.counts[REVISION] - store.counts[LOG_MASK] - 1))
