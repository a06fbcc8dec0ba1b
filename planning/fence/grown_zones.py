"""What a path must not enter, for laying it around a fence: convex pieces of the shapes, grown by what is kept.

An exclusion that is convex is one piece, of any other polygon each edge is: who begins on the right side and never
comes near an edge stays there. A piece is grown by circumscribing: its corners are cut at most 1 / cos(STEP_RAD / 2)
times too far. Whoever stands in such a corner, far enough from the shape itself, gets a side of his own.

Places are (N, 2) east and north of home. None of this is trusted: the certificate judges the path by its own means.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from planning.fence.distance import foot, inside_polygon
from planning.fence.fence_model import Fence, FenceCircle, FencePolygon
from planning.fence.home_plane import FARTHEST_M, HomePlane, longest_m
from planning.fence.judge import CIRCLE_SHARE, named_shapes

STEP_RAD = math.pi / 8
"""Between neighbouring sides of a grown corner."""
ROUNDING_M = 0.03
"""Beyond what is judged: places are rounded to 1e-7 degrees, and samples of a path to each other."""
SAME_RAD = 1e-6
NEAR_M = 1e-4


@dataclass(frozen=True, slots=True)
class GrownZone:
    """One convex piece: the intersection of half-planes ``normals @ place <= offsets_m``."""

    shape: str
    """ "exclusion polygon 2" """
    normals: F64
    """(K, 2) unit, outwards, counter-clockwise"""
    offsets_m: F64
    """(K,)"""
    corners_m: F64
    """(K, 2): the one between each side and the next."""


@dataclass(frozen=True, slots=True)
class Disc:
    """An inclusion circle made smaller: it is convex, so that two places in it see each other within it."""

    shape: str
    centre_m: F64
    radius_m: float

    def holds(self, places_m: F64) -> np.ndarray:
        return np.linalg.norm(places_m - self.centre_m, axis=1) <= self.radius_m

    def left_out(self, from_m: F64, to_m: F64) -> list[tuple[float, float]]:
        """Shares of a straight way that lie outside."""
        along, to = to_m - from_m, from_m - self.centre_m
        a, b, c = float(along @ along), float(along @ to), float(to @ to) - self.radius_m**2
        if a <= 0.0 or b * b <= a * c:
            return [(0.0, 1.0)] if c > 0.0 else []
        half = math.sqrt(b * b - a * c)
        return [(0.0, (-b - half) / a), ((-b + half) / a, 1.0)]


@dataclass(frozen=True, slots=True)
class Flat:
    """One shape of a fence in the plane."""

    name: str
    inclusion: bool
    corners_m: F64
    """(N, 2) counter-clockwise; (1, 2) the centre of a circle"""
    radius_m: float
    """0 of a polygon"""
    bend_m: float
    """How far a straight way of the flight may be off its edges for being straight elsewhere."""

    def room_m(self, places_m: F64) -> F64:
        """(N,) distances to what is forbidden; within it minus those to where it ends."""
        if len(self.corners_m) == 1:
            away_m = np.linalg.norm(places_m - self.corners_m[0], axis=1) - self.radius_m
            return -away_m if self.inclusion else away_m
        ends_m = np.roll(self.corners_m, -1, axis=0)
        away_m = np.min([_to_edge_m(places_m, p, q) for p, q in zip(self.corners_m, ends_m, strict=True)], axis=0)
        return np.where(inside_polygon(places_m, self.corners_m) == self.inclusion, away_m, -away_m)


def flat_shapes(fence: Fence, plane: HomePlane, flown_m: float) -> list[Flat]:
    """``flown_m``: the longest straight way. Shapes too far to be judged are left out: no certificate follows."""
    named = named_shapes(fence)
    return [_flat(name, each, plane, flown_m) for name, each in named if plane.reach_m(each) <= FARTHEST_M]


def zones_of(flat: Flat, margin_m: float, stands_m: F64) -> list[GrownZone]:
    """Its pieces; none of an inclusion circle. Places ``stands_m`` that keep the margin are outside of them."""
    if len(flat.corners_m) == 1:
        cores = [] if flat.inclusion else [flat.corners_m]
    elif not flat.inclusion and _is_convex(flat.corners_m):
        cores = [flat.corners_m]
    else:
        cores = list(np.stack([flat.corners_m, np.roll(flat.corners_m, -1, axis=0)], axis=1))
    grown_m = flat.radius_m + kept_m(flat, margin_m, stands_m)
    least_m = flat.radius_m + margin_m + flat.bend_m
    return [_grown(flat.name, core, grown_m, least_m, stands_m) for core in cores]


def kept_m(flat: Flat, margin_m: float, stands_m: F64) -> float:
    """The margin and what laying needs beyond it; less of that where a place stands in it."""
    least_m = margin_m + flat.bend_m
    room_m = flat.room_m(stands_m)
    tight_m = room_m[(room_m >= least_m) & (room_m < least_m + flat.bend_m + ROUNDING_M)]
    return float(max(least_m, tight_m.min() - NEAR_M)) if len(tight_m) else least_m + flat.bend_m + ROUNDING_M


def disc_of(flat: Flat, margin_m: float, stands_m: F64) -> Disc | None:
    if len(flat.corners_m) > 1 or not flat.inclusion:
        return None
    return Disc(flat.name, flat.corners_m[0], flat.radius_m - kept_m(flat, margin_m, stands_m))


def shadow(zone: GrownZone, from_m: F64) -> tuple[F64, F64] | None:
    """Normals and offsets of all places that do not see ``from_m`` past the zone; None: it stands within the zone."""
    front = zone.normals @ from_m > zone.offsets_m - NEAR_M / 10
    if not front.any():
        return None
    turns = np.flatnonzero(front != np.roll(front, -1))
    rays = zone.corners_m[turns] - from_m
    across = np.column_stack([rays[:, 1], -rays[:, 0]]) / np.linalg.norm(rays, axis=1, keepdims=True)
    middle_m = zone.corners_m.mean(axis=0) - from_m
    across *= np.where(across @ middle_m > 0.0, -1.0, 1.0)[:, None]
    return np.vstack([zone.normals[front], across]), np.concatenate([zone.offsets_m[front], across @ from_m])


def _flat(name: str, each: FencePolygon | FenceCircle, plane: HomePlane, flown_m: float) -> Flat:
    bend_m = plane.bend_m(flown_m)
    if isinstance(each, FenceCircle):
        share = -CIRCLE_SHARE if each.inclusion else CIRCLE_SHARE
        centre_m = plane.xy_m(each.centre_lat_lon_deg)
        return Flat(name, each.inclusion, centre_m, each.radius_m * (1.0 + share), bend_m)
    corners_m = plane.xy_m(each.corners_lat_lon_deg)
    (x, y), (to_x, to_y) = corners_m.T, np.roll(corners_m, -1, axis=0).T
    if float(np.sum(x * to_y - to_x * y)) < 0.0:
        corners_m = corners_m[::-1]
    return Flat(name, each.inclusion, corners_m, 0.0, bend_m + plane.bend_m(longest_m(corners_m[None])))


def _to_edge_m(places_m: F64, p: F64, q: F64) -> F64:
    return np.linalg.norm(foot(p, q, places_m) - places_m, axis=1)


def _is_convex(corners_m: F64) -> bool:
    """Of counter-clockwise corners."""
    edges = np.roll(corners_m, -1, axis=0) - corners_m
    after = np.roll(edges, -1, axis=0)
    return bool((edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0] >= 0.0).all())


def _grown(shape: str, core_m: F64, grown_m: float, least_m: float, stands_m: F64) -> GrownZone:
    zone = _with_sides(shape, core_m, grown_m, _round_rad(core_m))
    within = (stands_m @ zone.normals.T <= zone.offsets_m + NEAR_M).all(axis=1)
    if not within.any():
        return zone
    nearest_m = _nearest_on(core_m, stands_m[within])
    out = stands_m[within] - nearest_m
    stands = np.linalg.norm(out, axis=1) >= least_m
    facing_rad = np.arctan2(out[stands, 1], out[stands, 0])
    return _with_sides(shape, core_m, grown_m, np.concatenate([_round_rad(core_m), facing_rad]))


def _with_sides(shape: str, core_m: F64, grown_m: float, facing_rad: F64) -> GrownZone:
    """The core grown, with a side that faces each of these directions."""
    facing_rad = np.sort(facing_rad % math.tau)
    apart = np.diff(facing_rad, append=facing_rad[0] + math.tau) > SAME_RAD
    facing_rad = facing_rad[apart]
    normals = np.column_stack([np.cos(facing_rad), np.sin(facing_rad)])
    offsets_m = (normals @ core_m.T).max(axis=1) + grown_m
    after, after_m = np.roll(normals, -1, axis=0), np.roll(offsets_m, -1)
    turn = normals[:, 0] * after[:, 1] - normals[:, 1] * after[:, 0]
    x = (offsets_m * after[:, 1] - after_m * normals[:, 1]) / turn
    y = (after_m * normals[:, 0] - offsets_m * after[:, 0]) / turn
    return GrownZone(shape, normals, offsets_m, np.column_stack([x, y]))


def _round_rad(core_m: F64) -> F64:
    """Outward directions of the core's edges, and between them none farther apart than ``STEP_RAD``."""
    if len(core_m) == 1:
        return np.arange(0.0, math.tau - SAME_RAD, STEP_RAD)
    edges = np.roll(core_m, -1, axis=0) - core_m
    facing_rad = np.sort(np.arctan2(-edges[:, 0], edges[:, 1]) % math.tau)
    ends_rad = np.append(facing_rad[1:], facing_rad[0] + math.tau)
    parts = [
        np.linspace(a, b, max(1, math.ceil((b - a) / STEP_RAD - SAME_RAD)), endpoint=False)
        for a, b in zip(facing_rad, ends_rad, strict=True)
    ]
    return np.concatenate(parts)


def _nearest_on(core_m: F64, places_m: F64) -> F64:
    """(N, 2) places of the core that are nearest to places outside of it."""
    feet = np.stack([foot(p, q, places_m) for p, q in zip(core_m, np.roll(core_m, -1, axis=0), strict=True)])
    nearest = np.linalg.norm(feet - places_m, axis=2).argmin(axis=0)
    return feet[nearest, np.arange(len(places_m))]
