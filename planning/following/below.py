"""Whether a flight kept the clearance that was required of it, and the sentence that says if it did not.

The flown distance is that of the positions the vehicle tells. What was required held a term for following: a flight
that stays within it flew inside the tube that the certificate proves, and the sentence says so; it was lower than
required all the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from planning.following.figures import TrackFigures


@dataclass(frozen=True, slots=True)
class Demanded:
    """Of a flight, by its certificate or by the mission's own file."""

    required_m: float
    following_m: float = 0.0
    """Radius of the tube that was certified."""


@dataclass(frozen=True, slots=True)
class BelowRequired:
    """Where a flight came nearest, below what was required."""

    distance_m: float
    demanded: Demanded
    on_way_home: bool
    t_s: float

    @property
    def in_tube(self) -> bool:
        """Whether it departed from what was required by no more than following was allowed."""
        return self.distance_m >= self.demanded.required_m - self.demanded.following_m > 0

    @property
    def text(self) -> str:
        demanded = self.demanded
        where = "on the way home" if self.on_way_home else "on the mission"
        text = (
            f"The flight went below its required clearance: it came within {_down(self.distance_m)} m of the surface"
            f" model {where}, {_up(demanded.required_m)} m were required,"
            f" {_up(demanded.required_m - self.distance_m)} m more."
        )
        if demanded.following_m <= 0:
            return text
        tube = f"the {_up(demanded.following_m)} m that the certificate allows for following the line"
        return f"{text} {'It stayed within' if self.in_tube else 'That is more than'} {tube}."


def below_required(figures: TrackFigures, demanded: Demanded | None) -> BelowRequired | None:
    """None: it kept the clearance, or nothing is known of it. The lower of mission and way home counts.

    The way home counts when it led home: a vehicle that was landed elsewhere came down to the ground there.
    """
    if demanded is None:
        return None
    found = [(False, figures.nearest), (True, figures.nearest_on_way_home if figures.came_home else None)]
    low = [
        BelowRequired(nearest.distance_m, demanded, on_way_home, nearest.t_s)
        for on_way_home, nearest in found
        if nearest is not None and nearest.distance_m < demanded.required_m
    ]
    return min(low, key=lambda place: place.distance_m, default=None)


def _up(value_m: float) -> str:
    return f"{math.ceil(value_m * 100 - 1e-6) / 100:.2f}"


def _down(value_m: float) -> str:
    return f"{math.floor(value_m * 100 + 1e-6) / 100:.2f}"
