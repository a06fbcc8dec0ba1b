"""What a way must keep clear of: voxels that were seen, and the surface model around."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import F32, F64, Bools
from planning.certificate.nearest import nearest_distances, threads_for
from planning.certificate.pyramid import MaxPyramid, max_pyramid
from planning.evading.boxes import nearest_box

ENDLESS_M = 1000.0
"""Added to columns whose tops nobody has seen, where they count as endless."""


class Surface(Protocol):
    """A surface model under the map frame; ``mapping.perceiving.ground.GroundGrid`` is one."""

    @property
    def up_m(self) -> F32:
        """(rows, columns) NaN unknown"""
        ...

    @property
    def enu_to_cell(self) -> F64:
        """(2, 3) [row, column] = enu_to_cell @ [east, north, 1]"""
        ...

    @property
    def cell_m(self) -> float: ...


@dataclass(frozen=True, slots=True)
class Seen:
    """Occupied voxels of one map. Not those that known ground explains: the surface model stands for them."""

    centres_enu_m: F64
    """(N, 3)"""
    resolution_m: float
    half_up_m: F64 | None = None
    """(N,) Half the height of each, where they are columns; None: cubes."""
    is_open: Bools | None = None
    """(N,) Columns whose tops nobody has seen."""


class Room:
    """Distances of polylines (K, 3), ENU. Only what lies within ``reach_m`` of ``around_enu_m`` is looked at."""

    def __init__(self, around_enu_m: F64, reach_m: float, seen: Sequence[Seen], surface: Surface | None) -> None:
        low, high = around_enu_m.min(axis=0) - reach_m, around_enu_m.max(axis=0) + reach_m
        self.seen = [near for each in seen if len((near := _within(each, low, high)).centres_enu_m)]
        self._ground = None if surface is None else _Ground(surface, low[:2], high[:2])

    def with_unseen(self, from_enu_m: F64, depth_m: float) -> Room:
        """The same with all filled that lies up to ``depth_m`` behind what was seen, looking from a place (3,)."""
        other = copy.copy(self)
        other.seen = [*self.seen, *(_behind(each, from_enu_m, depth_m) for each in self.seen)]
        return other

    def with_open_tops(self) -> Room:
        """The same where nothing may be passed above whose top nobody has seen."""
        other = copy.copy(self)
        other.seen = [_endless(each) for each in self.seen]
        return other

    def seen_m(self, points_enu_m: F64, *, at_most_m: float = np.inf) -> float:
        """Smallest distance to any voxel; inf when none is nearer than ``at_most_m``."""
        found = np.inf
        for each in self.seen:
            limit = min(at_most_m, found)
            distance_m, _ = nearest_box(
                points_enu_m, each.centres_enu_m, each.resolution_m / 2, half_up_m=each.half_up_m, at_most_m=limit
            )
            found = min(found, distance_m)
        return found

    def surface_m(self, points_enu_m: F64) -> float:
        """Smallest distance to the surface model; unknown terrain and its outside reach up forever. inf without one."""
        return np.inf if self._ground is None else self._ground.distance_m(points_enu_m)

    def is_clear(self, points_enu_m: F64, keep_m: float) -> bool:
        return self.is_clear_of_seen(points_enu_m, keep_m) and self.surface_m(points_enu_m) >= keep_m

    def is_clear_of_seen(self, points_enu_m: F64, keep_m: float) -> bool:
        return self.seen_m(points_enu_m, at_most_m=keep_m) >= keep_m


def _within(seen: Seen, low: F64, high: F64) -> Seen:
    centres = np.asarray(seen.centres_enu_m, np.float64).reshape(-1, 3)
    inside = np.all((centres[:, :2] >= low[:2]) & (centres[:, :2] <= high[:2]), axis=1)
    return _picked(replace(seen, centres_enu_m=centres), inside)


def _picked(seen: Seen, which: Bools | NDArray[np.intp]) -> Seen:
    half_up_m = None if seen.half_up_m is None else seen.half_up_m[which]
    is_open = None if seen.is_open is None else seen.is_open[which]
    return Seen(seen.centres_enu_m[which], seen.resolution_m, half_up_m, is_open)


def _behind(seen: Seen, from_enu_m: F64, depth_m: float) -> Seen:
    """Voxels or columns of its own size, level behind each."""
    edge_m = seen.resolution_m
    flat = seen.centres_enu_m[:, :2] - from_enu_m[:2]
    away = flat / np.maximum(np.hypot(flat[:, 0], flat[:, 1]), 1e-9)[:, None]
    steps = np.arange(edge_m, depth_m + edge_m, edge_m)
    filled = np.repeat(seen.centres_enu_m[None, :, :], len(steps), axis=0)
    filled[:, :, :2] += steps[:, None, None] * away[None, :, :]
    if seen.half_up_m is not None:
        which = np.tile(np.arange(len(seen.centres_enu_m)), len(steps))
        return replace(_picked(seen, which), centres_enu_m=filled.reshape(-1, 3))
    keys = np.unique(np.floor(filled.reshape(-1, 3) / edge_m).astype(np.int64), axis=0)
    return Seen(((keys + 0.5) * edge_m).astype(np.float64), edge_m)


def _endless(seen: Seen) -> Seen:
    if seen.is_open is None or seen.half_up_m is None:
        return seen
    up_m = np.where(seen.is_open, ENDLESS_M / 2, 0.0)
    raised = seen.centres_enu_m + np.column_stack([np.zeros((len(up_m), 2)), up_m])
    return replace(seen, centres_enu_m=raised, half_up_m=seen.half_up_m + up_m)


class _Ground:
    """The part of a surface model over an area, in metres from its first cell's corner: x by columns, y by rows."""

    def __init__(self, surface: Surface, low_m: F64, high_m: F64) -> None:
        self._to_cell, self._cell_m = surface.enu_to_cell, surface.cell_m
        corners = np.array([[e, n, 1.0] for e in (low_m[0], high_m[0]) for n in (low_m[1], high_m[1])])
        cells = corners @ self._to_cell.T
        rows, columns = surface.up_m.shape
        r0, c0 = (max(0, math.floor(value)) for value in cells.min(axis=0))
        r1, c1 = (math.ceil(value) for value in cells.max(axis=0))
        self._first = np.array([r0, c0], dtype=np.float64)
        part = surface.up_m[r0 : min(rows, r1), c0 : min(columns, c1)]
        self._pyramid: MaxPyramid | None = None
        if part.size:
            self._pyramid = max_pyramid(np.ascontiguousarray(part, dtype=np.float32), self._cell_m)

    def distance_m(self, points_enu_m: F64) -> float:
        if self._pyramid is None:
            return 0.0
        flat = np.column_stack([points_enu_m[:, :2], np.ones(len(points_enu_m))])
        rows, columns = ((flat @ self._to_cell.T) - self._first).T * self._cell_m
        places = np.column_stack([columns, rows, points_enu_m[:, 2]])
        with threads_for(0):
            distances, _ = nearest_distances(self._pyramid, places[:-1], places[1:])
        return float(distances.min())
