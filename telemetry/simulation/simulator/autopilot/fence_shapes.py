"""Polygons and circles of a simulated vehicle's fence, and whether they allow a place. They have no height."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

Place = tuple[float, float]
"""North and east in the vehicle's frame."""


@dataclass(frozen=True, slots=True)
class FencePart:
    """A polygon, or a circle around its only corner."""

    inclusion: bool
    corners_ne_m: tuple[Place, ...]
    radius_m: float | None = None

    def allows(self, place_ne_m: Place) -> bool:
        return self._holds(place_ne_m) is self.inclusion

    def _holds(self, place: Place) -> bool:
        if self.radius_m is not None:
            return math.dist(place, self.corners_ne_m[0]) <= self.radius_m
        north, east = place
        inside = False
        for (an, ae), (bn, be) in pairwise((*self.corners_ne_m, self.corners_ne_m[0])):
            if (ae > east) != (be > east) and north < an + (bn - an) * (east - ae) / (be - ae):
                inside = not inside
        return inside


def allowed(parts: Iterable[FencePart], place_ne_m: Place) -> bool:
    """By every one of them."""
    return all(part.allows(place_ne_m) for part in parts)
