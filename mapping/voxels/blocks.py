"""The blocks of a map and their bricks: how they are found, how new ones are made, how all are forgotten."""

from __future__ import annotations

import numpy as np
from numba import njit

from mapping.voxels.store import (
    BRICK,
    BRICK_BITS,
    CHUNK,
    CHUNK_BITS,
    CHUNK_BYTES,
    ENTERED_AT_ONCE,
    EVER_HIT,
    EXPLAINED,
    LIMIT_BYTES,
    LOG_FROM,
    LOG_MASK,
    MOST_BLOCK_BYTES,
    N_BLOCKS,
    N_CHUNKS,
    N_CHUNKS_EVER_USED,
    N_ENTERED,
    N_EVER_USED,
    N_EXPLAINED,
    N_KNOWN,
    N_OCCUPIED,
    N_PAGES,
    N_REFUSED,
    N_TOUCHED,
    PLACES,
    REVISION,
    SCAN,
    TABLE_FIRST,
    VALUE,
    VOXELS_LOGGED,
    Store,
)


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
def _leave(store, first, block):
    """Takes the block, and what comes after it without a gap, out of the table that begins at ``first``."""
    mask = first - 1
    place = _home(store.keys[block, 0], store.keys[block, 1], store.keys[block, 2], mask)
    while store.table[first + place] != 0:
        store.table[first + place] = 0
        place = (place + 1) & mask


@njit(cache=True, nogil=True)
def left_bytes(store):
    counts = store.counts
    used = counts[N_EVER_USED] * MOST_BLOCK_BYTES + counts[N_CHUNKS_EVER_USED] * CHUNK_BYTES
    return counts[LIMIT_BYTES] - used


def used_share(store: Store) -> float:
    """Of the memory for blocks and chunks, 0 to 1: what was ever in use, since the arrays were made."""
    return 1.0 - float(left_bytes(store) / store.counts[LIMIT_BYTES])


@njit(cache=True, nogil=True)
def _more_bytes(store):
    """What a new block with its first chunk takes of the memory: nothing of what an emptied map has over."""
    counts = store.counts
    block = MOST_BLOCK_BYTES if counts[N_BLOCKS] == counts[N_EVER_USED] else 0
    return block + (CHUNK_BYTES if counts[N_CHUNKS] == counts[N_CHUNKS_EVER_USED] else 0)


@njit(cache=True, nogil=True)
def _take_chunk(store):
    """Number of a chunk more, all zeros; the memory for it must be left."""
    counts = store.counts
    chunk = counts[N_CHUNKS]
    if chunk < counts[N_CHUNKS_EVER_USED]:
        store.cells[chunk * PLACES : (chunk + 1) * PLACES] = 0
    else:
        counts[N_CHUNKS_EVER_USED] = chunk + 1
    counts[N_CHUNKS] = chunk + 1
    return chunk


def is_full(store: Store) -> bool:
    """Whether a block with a brick, or a chunk more for one, may find no room."""
    return bool(store.counts[N_BLOCKS] == len(store.keys) or left_bytes(store) < _more_bytes(store))


@njit(cache=True, nogil=True)
def find_or_make(store, bx, by, bz):
    """Number of the block; -1 where it would be a new one and the memory is full.

    A new one has its first chunk, so that no memory goes into blocks in which nothing finds room.
    """
    block = find(store, bx, by, bz)
    if block >= 0:
        return block
    counts = store.counts
    block = counts[N_BLOCKS]
    if block == store.keys.shape[0] or left_bytes(store) < _more_bytes(store):
        return -1
    if block < counts[N_EVER_USED]:
        store.bricks[block, :] = 0
        store.filled[block] = 0
        store.occupied[block] = 0
    else:
        counts[N_EVER_USED] = block + 1
    store.chunks[block, 0] = _take_chunk(store)
    store.keys[block, 0], store.keys[block, 1], store.keys[block, 2] = bx, by, bz
    store.stamp[block] = 0
    first = counts[TABLE_FIRST]
    _enter(store, first, block)
    counts[N_BLOCKS] = block + 1
    if 2 * (block + 1) > first and 4 * first <= store.table.size:
        _enter_next(store, 2 * first)
    return block


@njit(cache=True, nogil=True)
def _enter_next(store, first):
    """A few blocks more into the table that begins at ``first``, which is in use once it has all of them.

    So no scan waits until a large map's whole table is made anew; whoever searches the old one meanwhile finds in it
    all there is.
    """
    counts = store.counts
    for block in range(counts[N_ENTERED], min(counts[N_ENTERED] + ENTERED_AT_ONCE, counts[N_BLOCKS])):
        _enter(store, first, block)
        counts[N_ENTERED] = block + 1
    if counts[N_ENTERED] == counts[N_BLOCKS]:
        counts[TABLE_FIRST] = first
        counts[N_ENTERED] = 0


@njit(cache=True, nogil=True, inline="always")
def voxel_in(x, y, z):
    """Number of the voxel of this key in its block: two bits each of z, y and x for the brick, then one each."""
    return (z & 6) << 6 | (y & 6) << 4 | (x & 6) << 2 | (z & 1) << 2 | (y & 1) << 1 | (x & 1)


@njit(cache=True, nogil=True, inline="always")
def place_in(chunk, slot):
    """Where in ``Store.cells`` the brick of this slot of its block begins, by the chunk that the slot is in."""
    return (np.int64(chunk) * CHUNK + (slot - 1 & CHUNK - 1)) * BRICK


@njit(cache=True, nogil=True)
def place_of(store, block, voxel):
    """Where the cell of a voxel is; -1 where its brick is not there."""
    slot = np.int64(store.bricks[block, voxel >> BRICK_BITS])
    if slot == 0:
        return -1
    return place_in(store.chunks[block, (slot - 1) >> CHUNK_BITS], slot) + (voxel & BRICK - 1)


@njit(cache=True, nogil=True)
def make_brick(store, block, brick):
    """The slot of a brick, which is made where it is not there yet; 0 where the memory is full."""
    slot = np.int64(store.bricks[block, brick])
    if slot > 0:
        return slot
    counts = store.counts
    filled = np.int64(store.filled[block])
    if filled > 0 and filled & (CHUNK - 1) == 0:
        if counts[N_CHUNKS] == counts[N_CHUNKS_EVER_USED] and left_bytes(store) < CHUNK_BYTES:
            return 0
        store.chunks[block, filled >> CHUNK_BITS] = _take_chunk(store)
    store.filled[block] = filled + 1
    store.bricks[block, brick] = filled + 1
    return filled + 1


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
    while counts[N_KNOWN] > VOXELS_LOGGED * (counts[LOG_MASK] + 1) and 2 * (counts[LOG_MASK] + 1) <= store.log.size:
        _lengthen_log(store)


@njit(cache=True, nogil=True)
def _lengthen_log(store):
    """To twice its length; what is in it stays."""
    counts = store.counts
    length = counts[LOG_MASK] + 1
    oldest = max(counts[LOG_FROM], counts[REVISION] - length)
    for revision in range(oldest, counts[REVISION]):
        if revision & length:
            place = revision & (length - 1)
            store.log[length + place] = store.log[place]
            store.log_voxels[length + place] = store.log_voxels[place]
    counts[LOG_FROM] = oldest
    counts[LOG_MASK] = 2 * length - 1


@njit(cache=True, nogil=True, inline="always")
def state_of(kinds, cell):
    """KNOWN, OCCUPIED, EXPLAINED and EVER_HIT of a voxel with this cell."""
    return np.int64(kinds[cell & VALUE]) | (cell >> 12) & (EXPLAINED | EVER_HIT)


@njit(cache=True, nogil=True)
def empty(store):
    """Forgets every block; what it cost in memory stays for those to come."""
    counts = store.counts
    first = counts[TABLE_FIRST]
    for block in range(counts[N_BLOCKS]):
        _leave(store, first, block)
    for block in range(counts[N_ENTERED]):
        _leave(store, 2 * first, block)
    counts[N_ENTERED] = 0
    counts[N_CHUNKS] = 0
    counts[N_BLOCKS] = 0
    counts[N_KNOWN] = 0
    counts[N_OCCUPIED] = 0
    counts[N_EXPLAINED] = 0
    counts[N_REFUSED] = 0
    counts[REVISION] += 1
