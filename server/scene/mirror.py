"""A copy of one sensor's map, folded from the deltas on the bus, in chunks of 32 m, for drawing and planning.

What a map held when it began anew in flight is kept for planning: ``seen`` is both. A map that is told once more takes
the place of the one here with its last part: a node that dies meanwhile takes nothing with it.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import F64, I32, I64, U8, Bools
from server.scene.kept_voxels import Grid, Kept
from telemetry.topics.obstacles import MapDelta, MapName, MapOrigin, unpack_keys

ChunkKey = tuple[int, int, int]

CHUNK_M = 32.0
OCCUPIED_ABOVE = 127
DETAILS = (1, 2, 4, 8, 16)
"""Edges in voxels of what a drawn box may stand for."""
NEXT_NODE_S = 1.0
"""So long after the last word of a node that died nothing of the next one begins yet."""
_BITS = 20
_OFFSET = 1 << (_BITS - 1)
"""Keys beyond +-500,000 voxels are nobody's: 250 km of the finest map."""


@dataclass(slots=True)
class Chunk:
    """Occupied voxels, sorted by ``ids``."""

    ids: I64
    probability: U8
    explained: Bools
    boxes: tuple[int, ...] = ()
    """How many boxes it is at each of ``DETAILS``."""


@dataclass(frozen=True, slots=True)
class Voxels:
    """A map, or a part of it, as plain arrays."""

    keys: I32
    """(N, 3) floor(enu / resolution)"""
    probability: U8
    explained: Bools
    resolution_m: float
    origin: MapOrigin | None
    sensor: MapName

    @property
    def centres_enu_m(self) -> F64:
        return (self.keys.astype(np.float64) + 0.5) * self.resolution_m


@dataclass(slots=True)
class MapMirror:
    """From any thread: one fold or look at a time."""

    sensor: MapName
    origin: MapOrigin | None = None
    resolution_m: float = 0.0
    generation: int = 0
    """Another one: everything that was drawn is void."""
    revision: int = 0
    """Of the newest delta in it."""
    t_mono_s: float = 0.0
    """Of the newest frame in it."""
    folds: int = 0
    """Another one: what is held may be another."""
    kept_count: int = 0
    """Voxels that were seen before the map began anew."""
    has_forgotten: bool = False
    """More was seen before the map began anew than could be kept."""
    _kept: Kept = field(default_factory=Kept)
    _began_mono_s: float = 0.0
    """As the sensor's node says it."""
    _flies: bool = False
    _before_mono_s: float | None = None
    """Beginning of the map that was here when a flight was over last: however often that is told again, it is of it,
    until something is seen in it in the next flight."""
    _before_revision: int = 0
    """The newest of that map that was told before the next flight."""
    _clear_count: int | None = None
    """Of the order by which all maps were emptied last: what was told before it is void. None: none was given."""
    _parts_in: int = 0
    _parts: int = 0
    _lacks: bool = False
    """Something before the newest delta is missing: only the whole map mends that."""
    _untold_mono_s: float = -math.inf
    """Newest word of a map of which nothing has come."""
    _untold_run: str = ""
    """Of the node that said it."""
    _chunks: dict[ChunkKey, Chunk] = field(default_factory=dict)
    _retold: dict[ChunkKey, Chunk] | None = None
    """Of the same map, told once more; None: it is not."""
    _dirty: set[ChunkKey] = field(default_factory=set)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def voxel_count(self) -> int:
        with self._lock:
            return sum(len(chunk.ids) for chunk in self._chunks.values())

    def clear(self) -> None:
        """As if nothing had ever been heard."""
        with self._lock:
            self._empty()
            self._before_mono_s = None
            self._kept.forget()
            self._count()

    def on_flight(self, *, flies: bool) -> None:
        """The vehicle is in the air, or was disarmed: what is kept is of one flight, and what never came whole in it is
        waited for no longer."""
        with self._lock:
            if flies != self._flies:
                self._flies = flies
                self._kept.forget()
                if not flies and self.origin is not None:
                    self._before_mono_s, self._before_revision = self._began_mono_s, self.revision
                self._expect_nothing()  # what was waited for is of before
                if not flies and not self.is_complete:
                    self._empty()
                self._count()

    def dismiss(self, clear_count: int) -> None:
        """The operator has all maps emptied, by the order of this number (``PerceptionSettings.clear_count``): nothing
        counts that was told before a sensor's node heard of it."""
        with self._lock:
            self._clear_count = clear_count
            self._empty()
            self._before_mono_s = None  # a map that was emptied goes on as what it was
            self._kept.forget()
            self._count()

    def expect(self, t_mono_s: float, run: str = "", clear_count: int = 0) -> None:
        """Its node says that it holds something; if nothing of it was heard, that is missing. ``t_mono_s``: of the
        newest frame in it; ``run``: of the node, "" where it does not say. Another run: what the one before held died
        with it. ``clear_count``: as in a delta; what is void is not lost, but nothing is known before its node answers
        the order."""
        with self._lock:
            if self.origin is not None:
                return
            before, self._lacks = (self._lacks, self._kept.is_over_full), True
            if self._clear_count in (None, clear_count):
                if run and self._untold_run and run != self._untold_run:
                    self._lose_untold()
                self._untold_run = run or self._untold_run
                self._untold_mono_s = max(self._untold_mono_s, t_mono_s)
            if before != (True, self._kept.is_over_full):
                self._count()

    def fold(self, delta: MapDelta) -> bool:
        """Whether nothing is missing before it. Raises ValueError when the delta's arrays do not belong together."""
        keys = unpack_keys(delta.keys)
        probability = np.frombuffer(delta.probability, dtype=np.uint8)
        explained = np.frombuffer(delta.explained, dtype=np.uint8) != 0
        if not len(keys) == len(probability) == len(explained):
            raise ValueError(f"{len(keys)} keys, {len(probability)} probabilities, {len(explained)} verdicts")
        sound = (np.abs(keys) < _OFFSET).all(axis=1)
        with self._lock:
            if self._clear_count not in (None, delta.clear_count):
                return True
            follows, is_first = self._follows(delta), delta.whole and delta.part == 0
            self._begin(delta, is_first=is_first)
            self._note_flight(delta, keys[sound & (probability > OCCUPIED_ABOVE) & ~explained], follows=follows)
            self._lacks = not follows or (self._lacks and not is_first)
            self._parts_in, self._parts = delta.part + 1, delta.parts
            self._take(keys[sound], probability[sound], explained[sound])
            if self._retold is not None and self.is_complete:
                self._dirty |= self._chunks.keys() | self._retold.keys()
                self._chunks, self._retold = self._retold, None
            self._count()
            return follows

    def taken_dirty(self) -> set[ChunkKey]:
        """Chunks that have changed since they were last asked for; those that are empty now among them."""
        with self._lock:
            dirty, self._dirty = self._dirty, set()
            return dirty

    def chunk(self, key: ChunkKey) -> Voxels | None:
        with self._lock:
            chunk = self._chunks.get(key)
            return None if chunk is None else self._voxels([chunk])

    def voxels(self) -> Voxels:
        """All that is occupied."""
        with self._lock:
            return self._voxels(list(self._chunks.values()))

    @property
    def is_complete(self) -> bool:
        """No part that was told, or said to come, is missing."""
        return not self._lacks and self._parts_in >= self._parts

    def seen(self) -> tuple[Voxels, ...] | None:
        """All that is occupied, and what was seen in this flight before the map began anew; None while parts are
        missing."""
        with self._lock:
            return self._all() if self.is_complete else None

    def seen_so_far(self) -> tuple[Voxels, ...]:
        """The same, as far as it has come."""
        with self._lock:
            return self._all()

    def boxes(self) -> tuple[int, ...]:
        """How many there would be in all, at each of ``DETAILS``."""
        with self._lock:
            counts = np.array([chunk.boxes for chunk in self._chunks.values()], dtype=np.int64)
        return tuple(counts.reshape(-1, len(DETAILS)).sum(axis=0).tolist())

    @property
    def chunk_keys(self) -> list[ChunkKey]:
        with self._lock:
            return list(self._chunks)

    # With the lock held

    def _count(self) -> None:
        self.folds += 1
        self.kept_count, self.has_forgotten = self._kept.voxel_count, self._kept.is_over_full

    def _all(self) -> tuple[Voxels, ...]:
        told = () if self.origin is None else (self._voxels(list(self._chunks.values())),)
        again = () if self._retold is None else (self._voxels(list(self._retold.values())),)
        return (*told, *again, *(self._kept_voxels(grid) for grid in self._kept.grids))

    def _is_same_map(self, delta: MapDelta) -> bool:
        """Whether ``delta`` is of the map that is here."""
        here = self.origin, self.resolution_m, self._began_mono_s
        return here == (delta.origin, delta.resolution_m, delta.began_mono_s)

    def _follows(self, delta: MapDelta) -> bool:
        """Whether nothing is missing between what is here and ``delta``."""
        if delta.part:
            told = delta.part == self._parts_in and delta.parts == self._parts and delta.revision == self.revision
            return told and self._is_same_map(delta)
        if delta.whole:
            return True
        if delta.began_mono_s != self._began_mono_s or not (self.origin is None or self._is_same_map(delta)):
            return False
        return self._parts_in >= self._parts and self.revision in (delta.since, delta.revision)

    def _empty(self) -> None:
        self._dirty |= self._chunks.keys()
        self._chunks, self._retold = {}, None
        self.origin, self.resolution_m, self.revision, self._began_mono_s = None, 0.0, 0, 0.0
        self._parts_in = self._parts = 0
        self._lacks = False
        self._expect_nothing()
        self.generation += 1

    def _begin(self, delta: MapDelta, *, is_first: bool) -> None:
        if not self._is_same_map(delta) or (is_first and delta.revision < self.revision):
            self._begin_anew(delta)
        elif is_first or not delta.whole:
            self._end_retelling()
            if is_first:
                self._retold = {}
        self.t_mono_s, self.revision = delta.t_mono_s, delta.revision

    def _note_flight(self, delta: MapDelta, seen: I32, *, follows: bool) -> None:
        """A map of a flight before in which something is seen in this one, or may be, is this one's."""
        if self._began_mono_s != self._before_mono_s:
            return
        if not self._flies:
            self._before_revision = max(self._before_revision, delta.revision)
        elif delta.revision > self._before_revision:
            known = _unexplained_ids(self._chunks) if delta.whole else np.zeros(0, np.int64)
            is_more = not np.isin(_ids(seen), known).all()
            if not follows or is_more:
                self._before_mono_s = None

    def _begin_anew(self, delta: MapDelta) -> None:
        """Another map is told: the one that was here counts on where it was seen in this flight."""
        if self._flies and self.origin is not None and self._began_mono_s != self._before_mono_s:
            for chunks in (self._chunks, self._retold or {}):
                self._kept.keep((self.origin, self.resolution_m), _unexplained_ids(chunks))
            # What never came of it was seen, too; of a retelling the map before it is here, whole.
            self._kept.is_over_full |= self._lacks or (self._parts_in < self._parts and self._retold is None)
        if self.origin is None and delta.began_mono_s > self._untold_mono_s + NEXT_NODE_S:
            self._lose_untold()
        self._expect_nothing()
        self._forget()
        self._retold = None
        if (self.origin, self.resolution_m) != (delta.origin, delta.resolution_m):
            self.generation += 1
        self.origin, self.resolution_m, self._began_mono_s = delta.origin, delta.resolution_m, delta.began_mono_s

    def _lose_untold(self) -> None:
        """A map of this flight is gone of which nothing ever came."""
        self._kept.is_over_full |= self._flies and math.isfinite(self._untold_mono_s)

    def _expect_nothing(self) -> None:
        self._untold_mono_s, self._untold_run = -math.inf, ""

    def _end_retelling(self) -> None:
        """Its last part never came: what did counts beside what was there."""
        retold, self._retold = self._retold or {}, None
        for key, chunk in retold.items():
            self._merge(self._chunks, key, chunk.ids, chunk.probability, chunk.explained)

    def _forget(self) -> None:
        self._dirty |= self._chunks.keys()
        self._chunks = {}

    def _take(self, keys: I32, probability: U8, explained: Bools) -> None:
        if not len(keys):
            return
        chunks = self._chunks if self._retold is None else self._retold
        per_chunk = max(1, round(CHUNK_M / self.resolution_m))
        place = keys // per_chunk
        chunk_ids, ids = _ids(place), _ids(keys)
        order = np.lexsort((ids, chunk_ids))
        starts = np.flatnonzero(np.diff(chunk_ids[order], prepend=chunk_ids[order[0]] - 1))
        for part in np.split(order, starts[1:]):
            x, y, z = place[part[0]].tolist()
            self._merge(chunks, (x, y, z), ids[part], probability[part], explained[part])

    def _merge(self, chunks: dict[ChunkKey, Chunk], key: ChunkKey, ids: I64, probability: U8, explained: Bools) -> None:
        """The delta's word on a voxel is the last."""
        old = chunks.get(key)
        if old is not None:
            kept = ~np.isin(old.ids, ids)
            ids = np.concatenate([ids, old.ids[kept]])
            probability = np.concatenate([probability, old.probability[kept]])
            explained = np.concatenate([explained, old.explained[kept]])
        occupied = np.flatnonzero(probability > OCCUPIED_ABOVE)
        ids, first = np.unique(ids[occupied], return_index=True)
        chosen = occupied[first]
        self._dirty.add(key)
        if len(ids):
            chunks[key] = Chunk(ids, probability[chosen], explained[chosen], _box_counts(ids))
        else:
            chunks.pop(key, None)

    def _kept_voxels(self, grid: Grid) -> Voxels:
        origin, resolution_m = grid
        ids = self._kept.grids[grid]
        sure, known = np.full(len(ids), 255, np.uint8), np.zeros(len(ids), np.bool_)
        return Voxels(_keys(ids), sure, known, resolution_m, origin, self.sensor)

    def _voxels(self, chunks: list[Chunk]) -> Voxels:
        nothing = Chunk(np.zeros(0, np.int64), np.zeros(0, np.uint8), np.zeros(0, np.bool_))
        chunks = chunks or [nothing]
        return Voxels(
            _keys(np.concatenate([chunk.ids for chunk in chunks])),
            np.concatenate([chunk.probability for chunk in chunks]),
            np.concatenate([chunk.explained for chunk in chunks]),
            self.resolution_m,
            self.origin,
            self.sensor,
        )


def coarser(voxels: Voxels, detail: int) -> Voxels:
    """Boxes of ``detail`` voxels along each edge: as probable as their most probable voxel, explained if all are."""
    if detail == 1 or not len(voxels.keys):
        return voxels
    ids, where = np.unique(_ids(voxels.keys // detail), return_inverse=True)
    probability = np.zeros(len(ids), dtype=np.uint8)
    np.maximum.at(probability, where, voxels.probability)
    unexplained = np.zeros(len(ids), dtype=np.bool_)
    unexplained[where[~voxels.explained]] = True
    edge_m = voxels.resolution_m * detail
    return Voxels(_keys(ids), probability, ~unexplained, edge_m, voxels.origin, voxels.sensor)


def _unexplained_ids(chunks: dict[ChunkKey, Chunk]) -> I64:
    nothing = np.zeros(0, np.int64)
    return np.concatenate([nothing, *(chunk.ids[~chunk.explained] for chunk in chunks.values())])


def _box_counts(ids: I64) -> tuple[int, ...]:
    keys = _keys(ids)
    return (len(ids), *(len(np.unique(_ids(keys // detail))) for detail in DETAILS[1:]))


def _ids(keys: NDArray[np.integer]) -> I64:
    """(N, 3) -> (N,) one number each."""
    k = keys.astype(np.int64) + _OFFSET
    return (k[:, 0] << (2 * _BITS)) | (k[:, 1] << _BITS) | k[:, 2]


def _keys(ids: I64) -> I32:
    mask = (1 << _BITS) - 1
    return (np.stack([ids >> (2 * _BITS), (ids >> _BITS) & mask, ids & mask], axis=1) - _OFFSET).astype(np.int32)
