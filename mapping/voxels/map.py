"""A sparse occupancy map of any extent."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapping.errors import CapacityError
from mapping.geometry.arrays import F32, F64, I32, I64, Bools
from mapping.voxels import blocks, query, store
from mapping.voxels.checks import (
    checked_model,
    checked_origin,
    checked_points,
    checked_range,
    checked_size,
    checked_truths,
)
from mapping.voxels.marks import NO_GRID, Grid, along, box_around, count_with_key, mark_points
from mapping.voxels.rays import mark_rays
from mapping.voxels.update import apply_blocks, apply_grid, assign, begin_values, make_room_for_hits, mark_explained

LARGEST_GRID = 512**3
"""Voxels: 134 MB are set aside, of which a scan fills what its rays cross; never more than the map itself may have."""
USED_AGAIN = 1.0 / 3.0
"""Of its memory: an emptied map that has no more than that in blocks and chunks holds as much as a new one, whatever
comes next, known whole or scattered."""
NEED_FADES = 0.98
"""Of a grid, with each scan that needs less: a large one is given back after about 60 small ones."""
VOXELS_FOR_A_STEP = 8
"""How many voxels of a grid are looked through in the time that a ray's way across it takes longer without one."""


@dataclass(frozen=True, slots=True)
class Changes:
    """Voxels as they are now, each once. Who has the map of ``revision`` before and puts these in has it as it is."""

    keys: I32
    """(N, 3) floor(enu / resolution)"""
    probability: F32
    """(N,)"""
    explained: Bools
    """(N,)"""
    revision: int
    """To ask from the next time."""
    whole: bool
    """These are all voxels there are: forget what came before."""


class VoxelMap:
    """Occupancy in log-odds by OctoMap's rules (Hornung 2013), as both papers keep their maps.

    Each voxel is updated once per scan, hits before misses, log-odds clamped; voxels are half-open cubes of
    ``resolution_m`` with a corner at the origin, key ``floor(enu / resolution_m)``. ``prob_hit``, ``prob_miss`` and
    ``clamp`` are OctoMap's; a voxel is occupied when its probability is above ``occupied`` (Bigazzi 2022: 0.5).

    The map holds ``memory_limit_bytes`` at most. What finds no room is refused and counted; what is known goes on being
    updated. The grid that scans are marked in is not counted in ``size_bytes``: at most as much as the map may hold,
    and at most 134 MB. With ``reach_m`` a resolution at which a quarter of the ball of that radius (what a wide camera
    sees at once) does not fit is refused with CapacityError, which names the resolution that does.

    Lookups may run in another thread while a scan is put in; changing the map takes one thread at a time, and
    ``changed_since`` counts as changing it.
    """

    def __init__(
        self,
        *,
        resolution_m: float,
        prob_hit: float = 0.7,
        prob_miss: float = 0.4,
        clamp: tuple[float, float] = (0.12, 0.97),
        occupied: float = 0.5,
        memory_limit_bytes: int = 1_000_000_000,
        reach_m: float | None = None,
    ) -> None:
        checked_size(resolution_m, reach_m, memory_limit_bytes)
        self._model = checked_model(prob_hit, prob_miss, clamp, occupied)
        self._store = store.make_store(memory_limit_bytes)
        begin_values(self._store, self._model)
        self._resolution_m, self._memory_limit_bytes = float(resolution_m), int(memory_limit_bytes)
        self._marks, self._touched, self._needed = NO_GRID.marks, NO_GRID.touched, 0
        self._emptied_at = 0

    def insert(
        self,
        points_enu: ArrayLike,
        *,
        origin_enu: ArrayLike,
        max_range_m: float,
        explained: ArrayLike | None = None,
        discretize: bool = True,
    ) -> None:
        """One scan: hits where ``points_enu`` (N, 3) lie, misses on the way from ``origin_enu`` (3,) to them.

        Beyond ``max_range_m`` a ray is carved up to there and hits nothing. ``explained`` (N,) is each point's verdict,
        None: all unexplained. ``discretize`` sends one ray per voxel, to its centre, and judges the range there
        (OctoMap's option of that name); without it every point has a ray of its own. Points that are not finite or
        more than 2^30 voxels from the map's origin are left out. Raises ParameterError.
        """
        points = checked_points(points_enu)
        origin = checked_origin(origin_enu, self._resolution_m)
        reach_m = checked_range(max_range_m, self._resolution_m)
        ends = np.empty((max(1, len(points)), 3))
        grid = self._grid_around(points, origin, reach_m)
        truths = checked_truths(explained, len(points))
        blocks.begin_scan(self._store)
        n_ends = mark_points(self._store, grid, points, truths, self._resolution_m, origin, reach_m, discretize, ends)
        if not len(grid.marks):
            make_room_for_hits(self._store)
        mark_rays(self._store, grid, ends, n_ends, self._resolution_m, origin, reach_m)
        if len(grid.marks):
            apply_grid(self._store, self._model, grid)
        else:
            apply_blocks(self._store, self._model)

    def insert_hits(self, points_enu: ArrayLike, *, explained: ArrayLike | None = None) -> None:
        """One scan without misses: the radar's map keeps all it has seen (Bigazzi 2022)."""
        points = checked_points(points_enu)
        truths = checked_truths(explained, len(points))
        no_rays = np.empty((0, 3))
        blocks.begin_scan(self._store)
        mark_points(self._store, NO_GRID, points, truths, self._resolution_m, np.zeros(3), math.inf, False, no_rays)
        apply_blocks(self._store, self._model)

    def assign(self, keys: ArrayLike, occupied: ArrayLike) -> None:
        """Sets voxels (N, 3) to the clamp's upper bound where ``occupied`` (N,), else to its lower one."""
        centres = (np.asarray(keys, dtype=np.int64).reshape(-1, 3) + 0.5) * self._resolution_m
        truths = np.ascontiguousarray(np.broadcast_to(np.asarray(occupied, dtype=np.bool_), len(centres)))
        assign(self._store, self._model, centres, truths, self._resolution_m)

    def mark_explained(self, keys: ArrayLike, explained: ArrayLike) -> None:
        """Known voxels (N, 3) become explained or not, ``explained`` (N,) or one truth; others are passed over."""
        numbers = query.voxels_of(self._store, self.centres(keys), self._resolution_m)
        truths = np.broadcast_to(np.asarray(explained, dtype=np.bool_), numbers.shape)
        mark_explained(self._store, numbers, np.ascontiguousarray(truths))

    def probability(self, points_enu: ArrayLike) -> F64:
        """(N,) occupancy of the voxels that points (N, 3) lie in; NaN where never seen."""
        held = self._store  # once: another thread may empty the map meanwhile
        numbers = self._numbers(held, points_enu)
        _, log_odds, _ = query.describe(held, np.maximum(numbers, 0))
        return np.where(numbers >= 0, _probability(log_odds), np.nan)

    def explained(self, points_enu: ArrayLike) -> Bools:
        """(N,) whether points (N, 3) lie in explained voxels; False where never seen."""
        held = self._store
        numbers = self._numbers(held, points_enu)
        _, _, explained = query.describe(held, np.maximum(numbers, 0))
        return explained & (numbers >= 0)

    def occupied(self, *, explained: bool | None = None) -> F64:
        """(N, 3) centres of occupied voxels: all, or only those that are ``explained`` or not."""
        return self.centres(self.occupied_keys(explained=explained))

    def occupied_keys(self, *, explained: bool | None = None) -> I32:
        """(N, 3)"""
        mask = store.OCCUPIED if explained is None else store.OCCUPIED | store.EXPLAINED
        value = store.OCCUPIED | (store.EXPLAINED if explained else 0)
        held = self._store
        return query.describe(held, query.list_voxels(held, mask, value))[0]

    def known(self) -> tuple[I32, F32, Bools]:
        """Keys (N, 3), probability (N,) and explained (N,) of all voxels ever seen."""
        held = self._store
        keys, log_odds, explained = query.describe(held, query.list_voxels(held, store.KNOWN, store.KNOWN))
        return keys, _probability(log_odds), explained

    def changed_since(self, revision: int, *, ever_hit_only: bool = False) -> Changes:
        """Voxels that changed after ``revision``; all there are when the map was emptied or too much changed since.

        ``ever_hit_only`` leaves out those that no point has ever lain in: free space, most of what a scan with rays
        changes, and nothing that anybody draws.
        """
        now = self.revision
        whole = revision < max(self._emptied_at, store.logged_from(self._store)) or revision > now
        if whole:
            wanted = store.KNOWN | (store.EVER_HIT if ever_hit_only else 0)
            numbers = query.list_voxels(self._store, wanted, wanted)
        else:
            numbers = query.list_changes(self._store, revision, ever_hit_only)
        keys, log_odds, explained = query.describe(self._store, numbers)
        return Changes(keys, _probability(log_odds), explained, now, whole)

    def clear(self) -> None:
        """Forgets all voxels and what was refused; the memory is there for those to come.

        Blocks and chunks are used again. Where they have more than a third of the memory they might keep what comes
        next, which may need them in other proportions, from its room: then all arrays are made anew.
        """
        if blocks.used_share(self._store) <= USED_AGAIN or not self._begin_anew():
            blocks.empty(self._store)
        self._emptied_at = self.revision

    def _begin_anew(self) -> bool:
        """Whether the system gives the memory for it."""
        try:
            fresh = store.make_store(self._memory_limit_bytes)
        except CapacityError:
            return False
        begin_values(fresh, self._model)
        fresh.counts[[store.REVISION, store.LOG_FROM]] = self.revision + 1
        self._store = fresh
        return True

    def centres(self, keys: ArrayLike) -> F64:
        """(N, 3) of voxels by key (N, 3)."""
        return (np.asarray(keys, dtype=np.float64).reshape(-1, 3) + 0.5) * self._resolution_m

    @property
    def resolution_m(self) -> float:
        return self._resolution_m

    @property
    def revision(self) -> int:
        """Grows with every change of a voxel; the same as before: nothing has changed."""
        return int(self._store.counts[store.REVISION])

    @property
    def voxel_count(self) -> int:
        """Known voxels, free or occupied."""
        return int(self._store.counts[store.N_KNOWN])

    @property
    def occupied_count(self) -> int:
        return int(self._store.counts[store.N_OCCUPIED])

    @property
    def explained_count(self) -> int:
        """Of the occupied ones."""
        return int(self._store.counts[store.N_EXPLAINED])

    @property
    def size_bytes(self) -> int:
        """Memory in use; what was once filled stays in use."""
        return store.used_bytes(self._store)

    @property
    def grid_bytes(self) -> int:
        """Of the grid that scans are marked in, on top of ``size_bytes``."""
        return len(self._marks) + len(self._touched)

    @property
    def is_full(self) -> bool:
        """What is not known yet finds no room any more, at least not everywhere."""
        return blocks.is_full(self._store)

    @property
    def refused_updates(self) -> int:
        """Hits and misses of voxels that found no room, since the map was last emptied."""
        return int(self._store.counts[store.N_REFUSED])

    @property
    def blocks(self) -> store.Store:
        """The arrays, for kernels of this floor that look things up themselves."""
        return self._store

    def _numbers(self, held: store.Store, points_enu: ArrayLike) -> I64:
        return query.voxels_of(held, checked_points(points_enu), self._resolution_m)

    def _grid_around(self, points: F64, origin: F64, reach_m: float) -> Grid:
        """All that can be reached where that is small enough, else the box that these points need; else none."""
        grid = self._grid(np.stack([origin - reach_m, origin + reach_m]), math.inf)
        if not len(grid.marks):
            grid = self._grid(box_around(points, origin, reach_m), count_with_key(points, self._resolution_m))
        if not len(grid.marks):
            self._have_marks(0)
        return grid

    def _grid(self, box: F64, rays: float) -> Grid:
        """None where looking through a box costs more than it spares so few ``rays``."""
        lowest, highest = np.floor(box / (self._resolution_m * store.SIDE)).astype(np.int64).tolist()
        x, y, z = (high - low + 3 for low, high in zip(lowest, highest, strict=True))  # in blocks
        if x * y * z * store.VOXELS > min(self._most_marks, VOXELS_FOR_A_STEP * rays * store.SIDE * (x + y + z)):
            return NO_GRID
        self._have_marks(x * y * z * store.VOXELS)
        touched = self._touched[: -(-x * y * z // 8) * 8]
        places = along(0, x, 1), along(1, y, x), along(2, z, x * y)
        return Grid(self._marks, touched, *places, *((low - 1) * store.SIDE for low in lowest))

    @property
    def _most_marks(self) -> int:
        """So many that they and the blocks' flags, which come by eight, fit."""
        return max(0, min(LARGEST_GRID, self._memory_limit_bytes) - 8) * store.VOXELS // (store.VOXELS + 1)

    def _have_marks(self, voxels: int) -> None:
        """At least so many bytes; at most four times what the last scans needed, more are given back."""
        self._needed = max(voxels, int(self._needed * NEED_FADES))
        if voxels <= len(self._marks) <= 4 * self._needed:
            return
        self._marks, self._touched = NO_GRID.marks, NO_GRID.touched  # given back before there are new ones
        size = max(voxels, min(self._most_marks, self._needed * 5 // 4)) // 8 * 8
        touched = np.zeros(-(-size // (8 * store.VOXELS)) * 8, np.uint8)
        self._marks, self._touched = np.zeros(size, np.uint8), touched  # both or, where memory is out, neither


def _probability(log_odds: F32) -> F32:
    return np.float32(1.0) / (np.float32(1.0) + np.exp(-log_odds))
