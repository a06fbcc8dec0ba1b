"""A survey's lines without what its fence forbids: each is cut where it may not be flown, the rest stays as it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import Poi
from planning.errors import NothingLeftError
from planning.fence.grown_zones import Flat, flat_shapes
from planning.fence.home_plane import HomePlane, plane_at
from planning.route.around_fence import Blocked, Kept, backs_of, blocked_of, longest_way_m
from planning.route.poi import MIN_APART_M
from planning.route.survey import MIN_LINE_M
from planning.terrain.dsm import SurfaceModel

LONGER = 2.0
"""Ways around may be longer than any line: by this much at most they are taken to be."""
INSIDE_M = 1e-3
"""An end that was cut lies at least so far beyond what is forbidden."""
APART_M = MIN_APART_M + 0.05
"""The ends on both sides of a cut are at least so far apart, with what rounding may take."""


def fenced_lines(model: SurfaceModel, pois: Sequence[Poi], kept: Kept, *, ways_back: bool) -> tuple[Poi, ...]:
    """Starts and ends of what is left of lines, given as their starts and ends, in the same order.

    With ``ways_back`` also what does not see home and every rally point past the fence is left out, if these can be
    seen at all. Raises NothingLeftError where nothing is left.
    """
    plane = plane_at(kept.home_lat_lon_deg)
    ends_m, backs_m = plane.xy_m([(poi.lat_deg, poi.lon_deg) for poi in pois]), backs_of(plane, kept)
    flats = flat_shapes(kept.fence, plane, LONGER * longest_way_m(ends_m, backs_m))
    blocked = blocked_of(model, plane, flats, np.empty((0, 2)), backs_m, kept)
    sides_m = list(zip(ends_m[::2], ends_m[1::2], strict=True))
    found = [_parts(blocked, a, b, ways_back=ways_back) for a, b in sides_m]
    middles_m = [a + sum(part) / 2 * (b - a) for (a, b), parts in zip(sides_m, found, strict=True) for part in parts]
    may = iter(_may(flats, np.array(middles_m).reshape(-1, 2), kept.margin_m))
    left = []
    for k, each in enumerate(found):
        line, parts = pois[2 * k : 2 * k + 2], [part for part in each if next(may)]
        left += line if parts == [(0.0, 1.0)] else _ends(plane, line, ends_m[2 * k : 2 * k + 2], parts)
    if not left:
        raise NothingLeftError(
            "The fence leaves nothing of the survey: no part of its lines may be flown.",
            advice="Draw the area inside the fence, where home sees it past all that is to be kept out of.",
        )
    return tuple(left)


def lines_m(model: SurfaceModel, pois: Sequence[Poi]) -> float:
    """Length of all lines together."""
    xy_m = model.xy_from_lat_lon(np.array([(poi.lat_deg, poi.lon_deg) for poi in pois]))
    return float(np.linalg.norm(xy_m[1::2] - xy_m[::2], axis=1).sum())


def _parts(blocked: Blocked, a: F64, b: F64, *, ways_back: bool) -> list[tuple[float, float]]:
    """Shares of a line between its cuts that are long enough to be lines."""
    field = blocked.seeing if ways_back and blocked.seeing is not None else blocked.alone
    out = [*field.blocked(a, b), *(part for disc in blocked.discs for part in disc.left_out(a, b))]
    length_m = float(np.linalg.norm(b - a))
    parts, begins = [], 0.0
    for first, last in sorted([*(_cut(p, q, length_m) for p, q in out if q > p), (math.inf, math.inf)]):
        ends = min(1.0, first)
        if (ends - begins) * length_m >= MIN_LINE_M - INSIDE_M:
            parts.append((begins, ends))
        begins = max(begins, last)
    return parts


def _cut(first: float, last: float, length_m: float) -> tuple[float, float]:
    """So wide that what it parts can be told apart."""
    wider = max(INSIDE_M, (APART_M - (last - first) * length_m) / 2) / length_m
    return first - wider, last + wider


def _may(flats: list[Flat], places_m: F64, margin_m: float) -> list[bool]:
    """Edges part what is forbidden from what is not: one place of a part stands for all of it."""
    may = np.ones(len(places_m), np.bool_)
    for flat in flats:
        may &= flat.room_m(places_m) >= margin_m
    return may.tolist()


def _ends(plane: HomePlane, line: Sequence[Poi], ends_m: F64, parts: list[tuple[float, float]]) -> list[Poi]:
    shares = np.array(parts).reshape(-1)
    places = plane.lat_lon_deg(ends_m[0] + shares[:, None] * (ends_m[1] - ends_m[0]))
    return [
        replace(line[k % 2], lat_deg=float(lat_deg), lon_deg=float(lon_deg))
        for k, (lat_deg, lon_deg) in enumerate(places)
    ]
