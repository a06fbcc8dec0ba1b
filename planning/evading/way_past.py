"""A way past an obstacle, what it must keep to, and why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mapping.geometry.arrays import F64

Kind = Literal["over", "around", "sidestep"]


@dataclass(frozen=True, slots=True)
class AvoidanceParams:
    radius_m: float = 0.5
    """Of the vehicle."""
    required_m: float = 2.0
    """Between the vehicle's middle and anything else: the mission's own required clearance."""
    least_beside_m: float = 0.5
    """Beside the hull, where the vehicle stands: nearer to anything it is not moved by a prepared way."""
    ceiling_m: float = 30.0
    """Above the plan."""
    step_m: float = 0.5
    """Of the heights that are tried; sideways it is four times as much."""
    sideways_m: float = 40.0
    unseen_m: float = 15.0
    """So far behind what was seen, as seen from the vehicle, nothing is known and all counts as filled: of a building
    only the face towards the sensors has been seen."""
    ahead_m: float = 120.0
    """So much of the line ahead is looked at."""

    @property
    def keep_m(self) -> float:
        """Between the vehicle's middle and anything else, its hull at least."""
        return max(self.required_m, self.radius_m)


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """A way past what was seen. It is nowhere lower than the line that it leaves, nor than the vehicle was."""

    kind: Kind
    points_enu_m: F64
    """(M, 3) first the vehicle; the last lies on the line ahead, or above it."""
    leg: int
    """Of the line ahead, on which the last point lies: then the line's point ``leg + 1`` is flown to."""
    height_offset_m: float
    """So much higher than planned is the rest to be flown."""
    seen_m: float
    """Smallest distance of the vehicle's middle to a voxel; inf when none is near."""
    surface_m: float
    """The same to the surface model; inf without one."""
    length_m: float
    top_unseen: bool = False
    """It leads over something that may be higher than what was seen of it: ``seen_m`` counts from as far up as the
    radar looks."""


@dataclass(frozen=True, slots=True)
class NoWay:
    kind: Kind
    reason: str
    """For the pilot."""
