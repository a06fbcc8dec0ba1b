"""The mission's line ahead: cut to what matters, places along it, and where it is blocked."""

from __future__ import annotations

import itertools
import math

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import Polyline
from planning.evading.keep_clear import Room

LOOK_STEP_M = 1.0


class LineAhead(Polyline):
    """A polyline in ENU whose distance along is horizontal and vertical alike."""

    def __init__(self, points_enu_m: F64, longest_m: float) -> None:
        points = np.asarray(points_enu_m, np.float64).reshape(-1, 3)
        keep = np.concatenate([[True], np.any(np.diff(points, axis=0) != 0.0, axis=1)])
        self.legs = np.flatnonzero(keep)
        """Of each point kept, its index in the line that was given."""
        super().__init__(points[keep])
        self.length_m = min(float(self.along_m[-1]), longest_m)

    def leg_at(self, along_m: float) -> int:
        """Index, in the line that was given, of the point from which the leg there begins."""
        return int(self.legs[self.leg(along_m)])

    def after(self, along_m: float) -> F64:
        """The point at which the leg there ends."""
        return self.points_m[self.leg(along_m) + 1]

    def direction(self, along_m: float) -> F64:
        """(2,) horizontal, unit; of the nearest leg that is not straight up."""
        order = [self.leg(along_m), *range(len(self.points_m) - 1)]
        for k in order:
            if k + 1 < len(self.points_m):
                flat = self.points_m[k + 1, :2] - self.points_m[k, :2]
                length_m = math.hypot(*flat)
                if length_m > 1e-6:
                    return flat / length_m
        return np.array([0.0, 1.0])

    def blocked(self, room: Room, keep_m: float) -> tuple[float, float] | None:
        """First and last place that come nearer than ``keep_m`` to anything seen; to within a metre."""
        steps = max(1, math.ceil(self.length_m / LOOK_STEP_M))
        places = np.linspace(0.0, self.length_m, steps + 1)
        near = [
            (a, b) for a, b in itertools.pairwise(places) if room.seen_m(self.between(a, b), at_most_m=keep_m) < keep_m
        ]
        return (near[0][0], near[-1][1]) if near else None
