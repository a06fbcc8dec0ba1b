"""The shortest way between two places that enters none of a fence's zones, in the plane.

A shortest way is taut: it turns at corners of zones only, and passes each as a tangent (Lozano-Pérez and Wesley 1979).
Zones are taken in as ways meet them: the shortest way past some that meets no other is the shortest past all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from mapping.geometry.arrays import F64, I64
from planning.fence.grown_zones import Disc, GrownZone, shadow

TOUCHES_M = 1e-6
"""A way along a side does not enter."""
SHORTEST_M = 0.02
"""Corners closer than this are one."""


@dataclass(frozen=True, slots=True)
class Field:
    """Zones, and what hides behind them."""

    zones: tuple[GrownZone, ...]
    owner: I64
    """(B,) the zone of each blocked set."""
    normals: F64
    """(B, K, 2) half-planes of the sets; rows beyond ``sides`` are empty."""
    offsets_m: F64
    """(B, K)"""
    sides: I64
    """(B,)"""
    turns: tuple[np.ndarray, ...]
    """Of each zone's corners: whether a way may turn there."""

    def met(self, way_m: F64) -> set[int]:
        """Zones that a (K, 2) polyline enters, or in whose shadow it is."""
        hit = _entered(way_m, self.normals, self.offsets_m, self.sides)
        return set(self.owner[hit].tolist())

    def blocked(self, from_m: F64, to_m: F64) -> list[tuple[float, float]]:
        """Shares of the straight way that lie in what is blocked, overlapping as they come."""
        found = _blocked(from_m, to_m, self.normals, self.offsets_m, self.sides)
        return [(float(a), float(b)) for a, b in found if b > a]

    def names(self, zones: set[int]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(self.zones[k].shape for k in sorted(zones)))


@dataclass(frozen=True, slots=True)
class WayAround:
    """The shortest, or why there is none."""

    corners_m: F64
    """(N, 2) between its ends, in order; none where it is straight, or where there is none."""
    shapes: tuple[str, ...]
    """(N,) the shape that it turns at."""
    closed_by: tuple[str, ...]
    """Empty: this is the way."""


def field_of(
    zones: Sequence[GrownZone], discs: Sequence[Disc], seen_from_m: F64, allowed: Callable[[F64], np.ndarray]
) -> Field | None:
    """With ``seen_from_m`` (T, 2) also what does not see each of these places straight is blocked; None: one is
    within a zone. A way turns inside every disc, where ``allowed``."""
    sets: list[tuple[int, tuple[F64, F64]]] = []
    for k, zone in enumerate(zones):
        blocked = [(zone.normals, zone.offsets_m)] if not len(seen_from_m) else [shadow(zone, m) for m in seen_from_m]
        if any(each is None for each in blocked):
            return None
        sets += [(k, each) for each in blocked if each is not None]
    most = max((len(offsets_m) for _, (_, offsets_m) in sets), default=1)
    normals, offsets_m = np.zeros((len(sets), most, 2)), np.zeros((len(sets), most))
    for row, (_, (n, c)) in enumerate(sets):
        normals[row, : len(c)], offsets_m[row, : len(c)] = n, c
    return Field(
        zones=tuple(zones),
        owner=np.array([k for k, _ in sets], np.int64),
        normals=normals,
        offsets_m=offsets_m,
        sides=np.array([len(c) for _, (_, c) in sets], np.int64),
        turns=_turns(zones, discs, allowed),
    )


def way_around(field: Field, from_m: F64, to_m: F64) -> WayAround:
    """A place within a zone, or hidden by one, has none."""
    if held := field.met(np.stack([from_m, from_m])) | field.met(np.stack([to_m, to_m])):
        return WayAround(np.empty((0, 2)), (), field.names(held))
    taken: set[int] = set()
    way_m, at = np.stack([from_m, to_m]), np.empty(0, np.int64)
    while new := field.met(way_m) - taken:
        taken |= new
        found = _shortest(field, from_m, to_m, sorted(taken))
        if found is None:
            return WayAround(np.empty((0, 2)), (), field.names(taken))
        way_m, at = found
    shapes = [field.zones[k].shape for k in at]
    keep = np.linalg.norm(np.diff(way_m, axis=0), axis=1)[:-1] >= SHORTEST_M
    if len(keep) and np.linalg.norm(way_m[-1] - way_m[-2]) < SHORTEST_M:
        keep[-1] = False
    return WayAround(way_m[1:-1][keep], tuple(s for s, k in zip(shapes, keep, strict=True) if k), ())


def _turns(zones: Sequence[GrownZone], discs: Sequence[Disc], allowed: Callable[[F64], np.ndarray]) -> tuple:
    if not zones:
        return ()
    corners_m = np.vstack([zone.corners_m for zone in zones])
    may = allowed(corners_m)
    for disc in discs:
        may &= disc.holds(corners_m)
    return tuple(np.split(may, np.cumsum([len(zone.corners_m) for zone in zones])[:-1]))


def _shortest(field: Field, from_m: F64, to_m: F64, taken: list[int]) -> tuple[F64, I64] | None:
    """The way past these zones alone, and the zones it turns at."""
    zones = [field.zones[k] for k in taken]
    corners_m = np.vstack([from_m, to_m, *(zone.corners_m for zone in zones)])
    before_m = np.vstack([from_m, to_m, *(np.roll(zone.corners_m, 1, axis=0) for zone in zones)])
    after_m = np.vstack([from_m, to_m, *(np.roll(zone.corners_m, -1, axis=0) for zone in zones)])
    may = np.concatenate([[True, True], *(field.turns[k] for k in taken)])
    at = np.concatenate([[-1, -1], *(np.full(len(field.zones[k].corners_m), k) for k in taken)])
    rows = np.isin(field.owner, taken)
    i, j = _sight_lines(
        corners_m, before_m, after_m, may, field.normals[rows], field.offsets_m[rows], field.sides[rows]
    )
    length_m = np.linalg.norm(corners_m[i] - corners_m[j], axis=1)
    graph = csr_array((length_m, (i, j)), shape=(len(corners_m), len(corners_m)))
    total_m, previous = dijkstra(graph, directed=False, indices=0, return_predecessors=True)
    if not np.isfinite(total_m[1]):
        return None
    steps = [1]
    while steps[-1] != 0:
        steps.append(int(previous[steps[-1]]))
    steps.reverse()
    return corners_m[steps], at[steps[1:-1]]


@njit(cache=True, nogil=True)
def _within(
    ax: float, ay: float, bx: float, by: float, normals: F64, offsets_m: F64, sides: int
) -> tuple[float, float]:
    """From which to which share a segment lies within half-planes: what each leaves is cut (Cyrus and Beck 1978).

    Nowhere if the first is not the smaller.
    """
    begins, ends = 0.0, 1.0
    for k in range(sides):
        nx, ny = normals[k, 0], normals[k, 1]
        room = offsets_m[k] - TOUCHES_M - (nx * ax + ny * ay)
        rate = nx * (bx - ax) + ny * (by - ay)
        if rate > 0.0:
            ends = min(ends, room / rate)
        elif rate < 0.0:
            begins = max(begins, room / rate)
        elif room < 0.0:
            return 1.0, 0.0
        if begins >= ends:
            return 1.0, 0.0
    return begins, ends


@njit(cache=True, nogil=True)
def _enters(ax: float, ay: float, bx: float, by: float, normals: F64, offsets_m: F64, sides: int) -> bool:
    begins, ends = _within(ax, ay, bx, by, normals, offsets_m, sides)
    return begins < ends


@njit(cache=True, nogil=True)
def _blocked(p: F64, q: F64, normals: F64, offsets_m: F64, sides: I64) -> F64:
    found = np.empty((len(sides), 2))
    for b in range(len(sides)):
        found[b, 0], found[b, 1] = _within(p[0], p[1], q[0], q[1], normals[b], offsets_m[b], sides[b])
    return found


@njit(cache=True, nogil=True)
def _entered(way_m: F64, normals: F64, offsets_m: F64, sides: I64) -> np.ndarray:
    hit = np.zeros(len(sides), np.bool_)
    for b in range(len(sides)):
        for k in range(len(way_m) - 1):
            p, q = way_m[k], way_m[k + 1]
            if _enters(p[0], p[1], q[0], q[1], normals[b], offsets_m[b], sides[b]):
                hit[b] = True
                break
    return hit


@njit(cache=True, nogil=True)
def _passes(px: float, py: float, at: F64, before: F64, after: F64) -> bool:
    """Whether the line from (px, py) to a corner leaves both its neighbours on one side: an end has none, it does."""
    dx, dy = at[0] - px, at[1] - py
    one = dx * (before[1] - at[1]) - dy * (before[0] - at[0])
    other = dx * (after[1] - at[1]) - dy * (after[0] - at[0])
    least = -TOUCHES_M * (abs(dx) + abs(dy))
    return (one >= least and other >= least) or (one <= -least and other <= -least)


@njit(cache=True, nogil=True)
def _sight_lines(
    corners_m: F64, before_m: F64, after_m: F64, may: np.ndarray, normals: F64, offsets_m: F64, sides: I64
) -> tuple[I64, I64]:
    """Pairs of corners that see each other, each a tangent at both."""
    count = len(corners_m)
    free = may.copy()
    for i in range(2, count):
        x, y = corners_m[i]
        for b in range(len(sides)):
            inside = free[i]
            for k in range(sides[b]):
                inside = inside and normals[b, k, 0] * x + normals[b, k, 1] * y < offsets_m[b, k] - TOUCHES_M
            if inside:
                free[i] = False
                break
    pairs = np.empty((64, 2), np.int64)
    found = 0
    for i in range(count):
        for j in range(i + 1, count):
            if not (free[i] and free[j]):
                continue
            p, q = corners_m[i], corners_m[j]
            if not _passes(p[0], p[1], q, before_m[j], after_m[j]):
                continue
            if not _passes(q[0], q[1], p, before_m[i], after_m[i]):
                continue
            blocked = False
            for b in range(len(sides)):
                if _enters(p[0], p[1], q[0], q[1], normals[b], offsets_m[b], sides[b]):
                    blocked = True
                    break
            if blocked:
                continue
            if found == len(pairs):
                pairs = np.concatenate((pairs, np.empty_like(pairs)))
            pairs[found, 0], pairs[found, 1] = i, j
            found += 1
    return pairs[:found, 0].copy(), pairs[:found, 1].copy()
