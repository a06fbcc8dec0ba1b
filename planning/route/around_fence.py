"""Legs between places laid around a fence, over a surface model.

A leg keeps not only itself but all ways home and to rally points clear of the fence where there is such a way; else
itself alone, and the certificate says which way back is not clear. Where there is none at all it stays straight.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mapping.geometry.arrays import F64
from planning.fence.fence_model import Fence, LatLon, RallyPoint
from planning.fence.grown_zones import Disc, Flat, disc_of, flat_shapes, zones_of
from planning.fence.home_plane import HomePlane, plane_at
from planning.fence.ways_around import Field, WayAround, field_of, way_around
from planning.terrain.dsm import SurfaceModel

ROUNDS = 4
"""Straight lines of different frames bend apart with their length, which is known once the ways are."""
SPARE_M = 0.01
"""Beyond the distance that a place is told to be moved by."""


@dataclass(frozen=True, slots=True)
class Kept:
    """What is kept to, and how far from it."""

    fence: Fence
    home_lat_lon_deg: LatLon
    rally: tuple[RallyPoint, ...]
    margin_m: float
    """From the fence: as the certificate demands it."""
    from_edge_m: float
    """From the surface model's edge: nothing is known beyond."""


@dataclass(frozen=True, slots=True)
class LaidLeg:
    """From one place to the next."""

    corners_xy_m: F64
    """(N, 2) in the model's CRS, between its ends."""
    shapes: tuple[str, ...]
    """(N,) that it turns at."""
    closed_by: tuple[str, ...]
    """Shapes that leave no way; then it is straight, and enters one. Empty: it keeps to the fence."""


@dataclass(frozen=True, slots=True)
class Laid:
    legs: tuple[LaidLeg, ...]
    forbidden: tuple[str, ...]
    """(N,) of each place what is wrong with it; empty where it may be."""


def laid_legs(model: SurfaceModel, stands_xy_m: F64, kept: Kept) -> Laid:
    """Between (N, 2) places in the model's CRS, one after the other."""
    plane = plane_at(kept.home_lat_lon_deg)
    stands_m = plane.xy_m(model.lat_lon_from_xy(stands_xy_m))
    backs_m = backs_of(plane, kept)
    longest_m, laid_m = -1.0, stands_m
    flats, ways = [], []
    for _ in range(ROUNDS):
        if (flown_m := longest_way_m(laid_m, backs_m)) <= longest_m:
            break
        longest_m = flown_m
        flats = flat_shapes(kept.fence, plane, longest_m)
        blocked = blocked_of(model, plane, flats, stands_m, backs_m, kept)
        ways = [_way(blocked.seeing, blocked.alone, a, b) for a, b in pairwise(stands_m)]
        laid_m = np.vstack(
            [stands_m[:1], *(m for w, b in zip(ways, stands_m[1:], strict=True) for m in (w.corners_m, b))]
        )
    return Laid(
        tuple(LaidLeg(_xy_m(model, plane, w.corners_m), w.shapes, w.closed_by) for w in ways),
        _forbidden(flats, stands_m, kept.margin_m),
    )


@dataclass(frozen=True, slots=True)
class Blocked:
    """What the fence forbids, in the plane at home."""

    discs: tuple[Disc, ...]
    alone: Field
    """For the line itself."""
    seeing: Field | None
    """For all ways back as well; None: home or a rally point is too near to the fence."""


def blocked_of(
    model: SurfaceModel, plane: HomePlane, flats: list[Flat], stands_m: F64, backs_m: F64, kept: Kept
) -> Blocked:
    places_m = np.vstack([stands_m, backs_m])
    zones = [zone for flat in flats for zone in zones_of(flat, kept.margin_m, places_m)]
    discs = tuple(disc for flat in flats if (disc := disc_of(flat, kept.margin_m, places_m)) is not None)
    west, south, east, north = model.bounds_m

    def known(corners_m: F64) -> np.ndarray:
        x, y = _xy_m(model, plane, corners_m).T
        e = kept.from_edge_m
        return (x >= west + e) & (x <= east - e) & (y >= south + e) & (y <= north - e)

    alone = field_of(zones, discs, np.empty((0, 2)), known)
    assert alone is not None
    return Blocked(discs, alone, field_of(zones, discs, backs_m, known))


def backs_of(plane: HomePlane, kept: Kept) -> F64:
    """(T, 2) home and rally points in its plane."""
    return np.vstack([np.zeros((1, 2)), plane.xy_m([(point.lat_deg, point.lon_deg) for point in kept.rally])])


def _way(seeing: Field | None, alone: Field, from_m: F64, to_m: F64) -> WayAround:
    found = None if seeing is None else way_around(seeing, from_m, to_m)
    return way_around(alone, from_m, to_m) if found is None or found.closed_by else found


def _forbidden(flats: list[Flat], stands_m: F64, margin_m: float) -> tuple[str, ...]:
    """The worst that is wrong with each place."""
    if not flats:
        return ("",) * len(stands_m)
    rooms_m = np.stack([flat.room_m(stands_m) for flat in flats])
    lacks_m = margin_m + np.array([[flat.bend_m] for flat in flats]) - rooms_m
    worst = np.argmax(lacks_m, axis=0)
    return tuple(
        _forbidden_words(flats[k], float(rooms_m[k, n]), float(lacks_m[k, n]), margin_m) if lacks_m[k, n] > 0.0 else ""
        for n, k in enumerate(worst)
    )


def _forbidden_words(flat: Flat, room_m: float, lack_m: float, margin_m: float) -> str:
    side = "outside" if flat.inclusion else "inside"
    lies = f"{-room_m:.2f} m {side} {flat.name}" if room_m < 0.0 else f"{room_m:.2f} m from the edge of {flat.name}"
    return (
        f"lies {lies} of the fence, from which {margin_m:.2f} m are kept: move it {lack_m + SPARE_M:.2f} m"
        f" {'in' if flat.inclusion else 'out'}."
    )


def longest_way_m(line_m: F64, backs_m: F64) -> float:
    """Of the line's legs and of the ways back."""
    legs_m = np.linalg.norm(np.diff(line_m, axis=0), axis=1)
    return float(max(legs_m.max(initial=0.0), np.linalg.norm(line_m[:, None] - backs_m, axis=2).max()))


def _xy_m(model: SurfaceModel, plane: HomePlane, places_m: F64) -> F64:
    return model.xy_from_lat_lon(plane.lat_lon_deg(places_m)) if len(places_m) else np.empty((0, 2))
