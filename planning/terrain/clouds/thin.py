"""A cloud thinned while it is read: at most so many of its own points, spread evenly over what it shows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mapping.geometry.arrays import F64, I64, U8, U16, Bools
from planning.terrain.clouds.cloud import Box

_FINEST_M = 0.001
_HELD = 4
"""Times as many points as are wanted are held: enough to come close to that number at the end."""
_AXIS_BITS = 21
_FINER = 8.0
"""Times the first voxels are finer than those that would do where points filled the whole box around them."""
_STEPS = 6
"""Halvings of the interval in which the last edge lies."""


@dataclass(frozen=True, slots=True)
class ThinnedCloud:
    """Points of a cloud, to be looked at; nothing is planned over them."""

    xyz_m: F64
    """(N, 3) x, y, height: in the projection and the heights of the cloud's surface model."""
    rgb: U8 | None
    """(N, 3); None where the file has no colours."""
    voxel_m: float
    """Edge of the voxels of which each has one point, the highest in it."""


@dataclass(slots=True)
class Thinner:
    """One point for each voxel, so that what stands upright keeps its points and dense places lose most.

    The voxels double while more points come than are held. Which voxels they are does not depend on the order in which
    the points come; the highest of all that are added is always among those that stay.
    """

    corner_m: tuple[float, float]
    """Least x and y of all points."""
    most: int
    voxel_m: float
    xyz_m: F64 = field(default_factory=lambda: np.empty((0, 3)))
    rgb: U16 | None = None
    _new: list[tuple[F64, U16 | None]] = field(default_factory=list)
    _count: int = 0

    @classmethod
    def over(cls, bounds_m: Box, points: int, *, most: int) -> Thinner:
        """``points``: how many there will be, within these bounds."""
        west, south, east, north = bounds_m
        filled_m = math.sqrt((east - west) * (north - south) / (_HELD * most)) / _FINER if points > most else 0.0
        widest_m = max(east - west, north - south)
        return cls((west, south), most, max(_FINEST_M, filled_m, widest_m / 2 ** (_AXIS_BITS - 1)))

    def add(self, xyz_m: F64, rgb: U16 | None) -> None:
        """(N, 3) finite metres within the bounds, and (N, 3) colours: of all that is added, or of nothing."""
        kept = highest_of_each(xyz_m, self.corner_m, self.voxel_m)
        self._new.append((xyz_m[kept], None if rgb is None else rgb[kept]))
        self._count += len(kept)
        if self._count > _HELD * self.most:
            self._merge()

    def thinned(self) -> ThinnedCloud:
        """At most ``most`` points: in larger voxels than so far, where it takes that."""
        self._merge()
        voxel_m = self._last_edge_m()
        kept = highest_of_each(self.xyz_m, self.corner_m, voxel_m)
        rgb = None if self.rgb is None or not self.rgb.any() else _eight_bits(self.rgb)
        return ThinnedCloud(self.xyz_m[kept], None if rgb is None else rgb[kept], voxel_m)

    def _merge(self) -> None:
        parts = [(self.xyz_m, self.rgb), *self._new] if len(self.xyz_m) else self._new
        self._new = []
        if not parts:
            return
        self.xyz_m = np.concatenate([xyz_m for xyz_m, _ in parts])
        colors = [rgb for _, rgb in parts if rgb is not None]
        self.rgb = np.concatenate(colors) if len(colors) == len(parts) else None
        while self._voxels(self.voxel_m) > _HELD * self.most:
            self.voxel_m *= 2
        kept = highest_of_each(self.xyz_m, self.corner_m, self.voxel_m)
        self.xyz_m, self.rgb = self.xyz_m[kept], None if self.rgb is None else self.rgb[kept]
        self._count = len(kept)

    def _last_edge_m(self) -> float:
        """The smallest edge, nearly, with which few enough stay."""
        small_m = large_m = self.voxel_m
        while self._voxels(large_m) > self.most:
            small_m, large_m = large_m, 2 * large_m
        for _ in range(_STEPS if large_m > small_m else 0):
            middle_m = (small_m + large_m) / 2
            if self._voxels(middle_m) > self.most:
                small_m = middle_m
            else:
                large_m = middle_m
        return large_m

    def _voxels(self, edge_m: float) -> int:
        return int(np.count_nonzero(_begins(np.sort(_keys(self.xyz_m, self.corner_m, edge_m)))))


def highest_of_each(xyz_m: F64, corner_m: tuple[float, float], edge_m: float) -> I64:
    """(N, 3) -> indices of the highest point of each voxel, of equally high ones the first."""
    if not len(xyz_m):
        return np.empty(0, np.int64)
    # A sort by voxel and height together takes twice as long.
    keys = _keys(xyz_m, corner_m, edge_m)
    order = np.argsort(keys, kind="stable")
    first, heights_m = _begins(keys[order]), xyz_m[order, 2]
    voxel = np.cumsum(first) - 1
    tops = np.flatnonzero(heights_m == np.maximum.reduceat(heights_m, np.flatnonzero(first))[voxel])
    return np.asarray(order[tops[_begins(voxel[tops])]], dtype=np.int64)


def _begins(values: I64) -> Bools:
    """(N,) sorted -> where each differs from the one before."""
    begins = np.ones(len(values), dtype=bool)
    begins[1:] = values[1:] != values[:-1]
    return begins


def _keys(xyz_m: F64, corner_m: tuple[float, float], edge_m: float) -> I64:
    """(N,) one number for each voxel. Heights come round again after 2 million voxels: few such share a column."""
    steps = np.floor((xyz_m - [*corner_m, 0.0]) / edge_m)
    column, row, level = (np.clip(steps, -(2.0**52), 2.0**52).astype(np.int64) & (2**_AXIS_BITS - 1)).T
    return (column << 2 * _AXIS_BITS) | (row << _AXIS_BITS) | level


def _eight_bits(rgb: U16) -> U8:
    """Of colours in 16 bits; writers that fill only the lower 8 of them are many."""
    return (rgb >> 8 if rgb.max() > 255 else rgb).astype(np.uint8)
