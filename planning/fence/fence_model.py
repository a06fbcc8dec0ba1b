"""What a fence and rally points are, and what they cannot be.

Places are WGS84, rounded to the 1e-7 degrees that vehicles keep. A fence has no height but for its floor and its
ceiling: its shapes reach from the ground to the sky, as they do for autopilots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from mapping.geometry.polygons import area_m2, crossing_edges
from planning.errors import FormatError

PLACE_DECIMALS = 7
MOST_CORNERS = 1000
"""Of all shapes; vehicles hold fewer."""
LARGEST_M = 100_000.0
"""Radius of a circle, and from a polygon's first corner to any other: beyond it lies a slip."""
LEAST_AREA_M2 = 1.0
LatLon = tuple[float, float]
"""lat_deg, lon_deg"""


@dataclass(frozen=True, slots=True)
class FencePolygon:
    inclusion: bool
    """The vehicle stays inside; otherwise outside."""
    corners_lat_lon_deg: tuple[LatLon, ...]
    """The first is not repeated."""


@dataclass(frozen=True, slots=True)
class FenceCircle:
    inclusion: bool
    centre_lat_lon_deg: LatLon
    radius_m: float


@dataclass(frozen=True, slots=True)
class Fence:
    """Where a vehicle may be: inside EVERY inclusion, outside every exclusion, between floor and ceiling.

    PX4, and ArduPilot if told so, are content with one of several inclusions; whoever is inside all of them satisfies
    either.
    """

    polygons: tuple[FencePolygon, ...] = ()
    circles: tuple[FenceCircle, ...] = ()
    floor_rel_home_m: float | None = None
    ceiling_rel_home_m: float | None = None

    def __bool__(self) -> bool:
        return bool(self.polygons or self.circles) or self.has_heights

    @property
    def has_heights(self) -> bool:
        return self.floor_rel_home_m is not None or self.ceiling_rel_home_m is not None


@dataclass(frozen=True, slots=True)
class RallyPoint:
    """Where a vehicle may return to instead of home, if it is nearer."""

    lat_deg: float
    lon_deg: float
    alt_rel_home_m: float


NO_FENCE = Fence()


def place(lat_deg: float, lon_deg: float) -> LatLon:
    """As vehicles keep it."""
    return round(lat_deg, PLACE_DECIMALS), round(lon_deg, PLACE_DECIMALS)


def polygon(corners: list[LatLon], *, inclusion: bool, where: str) -> FencePolygon:
    """Raises FormatError for what encloses nothing; a last corner that repeats the first is left out."""
    ring = [place(*corner) for corner in corners]
    ring = ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring
    if len(set(ring)) < 3:
        raise FormatError(
            f"A fence's polygon needs three corners, this one has {len(set(ring))}.",
            where=where,
            advice="Draw it again with three corners or more.",
        )
    if len(ring) > MOST_CORNERS:
        raise FormatError(
            f"The polygon has {len(ring)} corners; at most {MOST_CORNERS} are judged.",
            where=where,
            advice="Use fewer corners.",
        )
    xy_m = _flat_m(ring)
    if float(np.hypot(*xy_m.T).max()) > LARGEST_M:
        raise FormatError(
            f"The polygon reaches farther than {LARGEST_M / 1000:.0f} km.",
            where=where,
            advice="Check its corners: latitude first, longitude second, in degrees.",
        )
    _refuse_shape(ring, xy_m, where)
    return FencePolygon(inclusion, tuple(ring))


def circle(lat_deg: float, lon_deg: float, radius_m: float, *, inclusion: bool, where: str) -> FenceCircle:
    """Raises FormatError for a radius that encloses nothing."""
    if not 0.0 < radius_m <= LARGEST_M:
        raise FormatError(
            f"A fence's circle has a radius of {radius_m:g} m.",
            where=where,
            advice=f"It must be above zero, at most {LARGEST_M / 1000:.0f} km.",
        )
    return FenceCircle(inclusion, place(lat_deg, lon_deg), radius_m)


def fence(
    polygons: list[FencePolygon],
    circles: list[FenceCircle],
    *,
    floor_rel_home_m: float | None,
    ceiling_rel_home_m: float | None,
    where: str,
) -> Fence:
    """Raises FormatError for a floor that is not below the ceiling, and for more corners than are judged."""
    count = sum(len(each.corners_lat_lon_deg) for each in polygons) + len(circles)
    if count > MOST_CORNERS:
        raise FormatError(
            f"The fence has {count} corners and circles; at most {MOST_CORNERS} are judged.",
            where=where,
            advice="Use fewer.",
        )
    low_m, high_m = floor_rel_home_m, ceiling_rel_home_m
    if low_m is not None and high_m is not None and not low_m < high_m:
        raise FormatError(
            f"The fence's floor, {low_m:g} m above home, is not below its ceiling, {high_m:g} m.",
            where=where,
            advice="Correct one of them.",
        )
    return Fence(tuple(polygons), tuple(circles), low_m, high_m)


def within_both(one: Fence, other: Fence) -> Fence:
    """The fence of who keeps to both."""
    floors_m = [each.floor_rel_home_m for each in (one, other) if each.floor_rel_home_m is not None]
    ceilings_m = [each.ceiling_rel_home_m for each in (one, other) if each.ceiling_rel_home_m is not None]
    return Fence(
        tuple(dict.fromkeys((*one.polygons, *other.polygons))),
        tuple(dict.fromkeys((*one.circles, *other.circles))),
        max(floors_m, default=None),
        min(ceilings_m, default=None),
    )


def fence_words(fence: Fence, rally: tuple[RallyPoint, ...]) -> str:
    """What there is, counted."""
    counts = (
        (len(fence.polygons), "polygon", "polygons"),
        (len(fence.circles), "circle", "circles"),
        (len(rally), "rally point", "rally points"),
    )
    words = [f"{count} {one if count == 1 else many}" for count, one, many in counts if count]
    heights = [
        f"{name} at {value_m:g} m above home"
        for name, value_m in (("floor", fence.floor_rel_home_m), ("ceiling", fence.ceiling_rel_home_m))
        if value_m is not None
    ]
    return f"Fence: {', '.join([*words, *heights])}"


def _flat_m(ring: list[LatLon]) -> F64:
    """(N, 2) east and north of the first corner."""
    lat_deg, lon_deg = np.array(ring).T
    return np.column_stack(offset_m(ring[0], lat_deg, lon_deg))


def _refuse_shape(ring: list[LatLon], xy_m: F64, where: str) -> None:
    doubled = next((k for k, (a, b) in enumerate(zip(ring, ring[1:] + ring[:1], strict=True)) if a == b), None)
    crossing = crossing_edges(xy_m)
    if doubled is not None:
        what = f"has its corner {doubled + 1} twice"
    elif crossing is not None:
        what = f"crosses or touches itself: its edges {crossing[0] + 1} and {crossing[1] + 1} meet"
    elif area_m2(xy_m) < LEAST_AREA_M2:
        what = "encloses nothing: its corners lie on one line"
    else:
        return
    raise FormatError(f"The fence's polygon {what}.", where=where, advice="Draw it again without crossing lines.")
