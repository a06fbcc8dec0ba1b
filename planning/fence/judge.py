"""Whether a flight keeps inside a fence: the line, and the ways home and to rally points from everywhere on it.

Distances are horizontal, in the tangent plane at home; an exclusion reaches from the ground to the sky. The line is
straight in the surface model's CRS, a fence's edge in the autopilot's own frame: how far straight lines of their
lengths can bend apart is taken off every distance. ArduPilot counts metres on a sphere: each circle is taken wider, or
narrower if it is an inclusion, by as much as that can be off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64
from planning.fence.distance import NearestOfTriangles, to_circle, to_polygon
from planning.fence.fence_model import Fence, FenceCircle, FencePolygon, LatLon
from planning.fence.home_plane import FARTHEST_M, HomePlane, longest_m, plane_at

CIRCLE_SHARE = 0.007
"""Of a radius: metres on a sphere differ from true ones by up to 0.6 %."""
Part = Literal["line", "home", "rally"]


@dataclass(frozen=True, slots=True)
class FencedFlight:
    """What is held against a fence."""

    line_lat_lon_deg: F64
    """(K, 2)"""
    line_rel_home_m: F64
    """(K,) heights above home"""
    home_lat_lon_deg: LatLon
    rally_lat_lon_deg: tuple[LatLon, ...]
    return_rel_home_m: float
    """The highest that a way home is flown, where it does not begin higher."""
    margin_m: float
    """How far the vehicle's outermost point may be from where it should be."""


@dataclass(frozen=True, slots=True)
class FenceVerdict:
    """The nearest that a flight comes to what its fence forbids."""

    keeps: bool
    line_keeps: bool
    """Whatever is wrong is so of ways back alone."""
    margin_m: float
    """Kept from it: vehicle radius + position error + following."""
    min_distance_m: float
    """Horizontally; 0 within what is forbidden; inf without any shape."""
    shape: str
    """ "exclusion polygon 2", as counted in the file; empty without any shape."""
    part: Part
    """The line, a way home or a way to a rally point."""
    lat_deg: float
    lon_deg: float
    lowest_rel_home_m: float
    """Of the line."""
    highest_rel_home_m: float
    """Of the line and of the ways back."""
    faults: tuple[str, ...]
    """Sentences; none when the fence is kept."""

    @property
    def is_of_ways_back(self) -> bool:
        """All that is wrong is a way back that meets a shape, at no forbidden height."""
        return self.line_keeps and len(self.faults) == 1 and self.min_distance_m < self.margin_m


def judge_fence(fence: Fence, flight: FencedFlight) -> FenceVerdict:
    """The verdict on a flight of which all places are finite."""
    frame = plane_at(flight.home_lat_lon_deg)
    distance_m, shape, part, place_m, far = math.inf, "", "line", np.zeros(2), ""
    line_m = math.inf
    parts = _parts(flight, frame)
    longest_way_m = max(longest_m(triangles) for _, triangles in parts)
    for name, each in named_shapes(fence):
        if frame.reach_m(each) > FARTHEST_M:
            far = name
        for kind, triangles in parts:
            nearest = _nearest(triangles, each, frame, longest_way_m)
            k, found_m = nearest.worst()
            line_m = min(line_m, found_m) if kind == "line" else line_m
            if found_m < distance_m:
                distance_m, shape, part, place_m = found_m, name, kind, nearest.place_m[k]
    at_lat_deg, at_lon_deg = map(float, frame.lat_lon_deg(place_m[None])[0])
    heights_m = flight.line_rel_home_m
    lowest_m, line_highest_m = float(heights_m.min()), float(heights_m.max())
    highest_m = max(line_highest_m, flight.return_rel_home_m)
    line_too_high_or_low = bool(_height_words(fence, lowest_m, line_highest_m, flight.margin_m))
    faults = [
        *([_far_words(far)] if far else []),
        *(
            [_near_words(distance_m, shape, part, (at_lat_deg, at_lon_deg), flight)]
            if distance_m < flight.margin_m
            else []
        ),
        *_height_words(fence, lowest_m, highest_m, flight.margin_m),
    ]
    return FenceVerdict(
        keeps=not faults,
        line_keeps=not far and not line_too_high_or_low and line_m >= flight.margin_m,
        margin_m=flight.margin_m,
        min_distance_m=distance_m,
        shape=shape,
        part=part,
        lat_deg=at_lat_deg,
        lon_deg=at_lon_deg,
        lowest_rel_home_m=lowest_m,
        highest_rel_home_m=highest_m,
        faults=tuple(faults),
    )


def _parts(flight: FencedFlight, frame: HomePlane) -> list[tuple[Part, F64]]:
    """(K, 3, 2) triangles of the line, of the ways home and of those to each rally point."""
    xy_m = frame.xy_m(flight.line_lat_lon_deg)
    a, b = xy_m[:-1], xy_m[1:]

    def swept(target_m: F64) -> F64:
        return np.stack([a, b, np.broadcast_to(target_m, a.shape)], axis=1)

    parts: list[tuple[Part, F64]] = [("line", np.stack([a, b, b], axis=1))]
    parts.append(("home", swept(frame.xy_m(flight.home_lat_lon_deg)[0])))
    parts.extend(("rally", swept(target_m)) for target_m in frame.xy_m(flight.rally_lat_lon_deg))
    return parts


def named_shapes(fence: Fence) -> list[tuple[str, FencePolygon | FenceCircle]]:
    """ "exclusion polygon 2", as counted in the file"""
    return [
        (f"{'inclusion' if each.inclusion else 'exclusion'} {kind} {number}", each)
        for kind, shapes in (("polygon", fence.polygons), ("circle", fence.circles))
        for number, each in enumerate(shapes, start=1)
    ]


def _nearest(triangles: F64, shape: FencePolygon | FenceCircle, frame: HomePlane, flown_m: float) -> NearestOfTriangles:
    """``flown_m``: the longest straight way of the flight."""
    if isinstance(shape, FenceCircle):
        share = -CIRCLE_SHARE if shape.inclusion else CIRCLE_SHARE
        centre_m = frame.xy_m(shape.centre_lat_lon_deg)[0]
        found = to_circle(triangles, centre_m, shape.radius_m * (1.0 + share), inclusion=shape.inclusion)
        bend_m = frame.bend_m(flown_m)
    else:
        corners_m = frame.xy_m(shape.corners_lat_lon_deg)
        found = to_polygon(triangles, corners_m, inclusion=shape.inclusion)
        bend_m = frame.bend_m(flown_m) + frame.bend_m(longest_m(corners_m[None]))
    return NearestOfTriangles(np.maximum(0.0, found.distance_m - bend_m), found.place_m)


def _far_words(shape: str) -> str:
    return f"The {shape} reaches farther than {FARTHEST_M / 1000:.0f} km from home: it is not judged."


def _near_words(distance_m: float, shape: str, part: Part, at: LatLon, flight: FencedFlight) -> str:
    who = {"line": "The line", "home": "A way home", "rally": "A way to a rally point"}[part]
    place = f"at {at[0]:.7f}, {at[1]:.7f}"
    if distance_m <= 0.0:
        does = "leaves" if shape.startswith("inclusion") else "enters"
        return f"{who} {does} {shape} of the fence {place}."
    return (
        f"{who} comes within {math.floor(distance_m * 100) / 100:.2f} m of the edge of {shape} of the fence {place};"
        f" the vehicle may be {math.ceil(flight.margin_m * 100) / 100:.2f} m beside it."
    )


def _height_words(fence: Fence, lowest_m: float, highest_m: float, margin_m: float) -> list[str]:
    """The columns of take-off and landing are left out of the floor."""
    words = []
    if fence.floor_rel_home_m is not None and lowest_m - margin_m < fence.floor_rel_home_m:
        words.append(
            f"The line comes down to {lowest_m:.2f} m above home, and the vehicle may be {margin_m:.2f} m lower: the"
            f" fence's floor is at {fence.floor_rel_home_m:g} m."
        )
    if fence.ceiling_rel_home_m is not None and highest_m + margin_m > fence.ceiling_rel_home_m:
        words.append(
            f"The line or a way home climbs to {highest_m:.2f} m above home, and the vehicle may be {margin_m:.2f} m"
            f" higher: the fence's ceiling is at {fence.ceiling_rel_home_m:g} m."
        )
    return words
