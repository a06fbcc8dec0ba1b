"""Ways along which shapes of a world move, the same at every flight: places and velocities by simulated time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

Repeat = Literal["back_and_forth", "around", "once"]
REPEATS: tuple[Repeat, ...] = ("back_and_forth", "around", "once")
Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Motion:
    """At a constant speed along straight lines, turning on the spot; it begins when the simulation does."""

    points_m: tuple[Pair, ...]
    """At least two, no two in a row the same; east and north of the world's origin."""
    speed_m_s: float
    repeat: Repeat = "back_and_forth"
    """around: from the last point straight to the first; once: it stays at the last one."""
    after_s: float = 0.0
    """It has stood at the first point until then."""

    def at(self, t_s: float) -> tuple[Pair, Pair]:
        """(place, velocity), each east and north."""
        points = self._round()
        steps = np.diff(points, axis=0)
        lengths = np.hypot(*steps.T)
        whole_m = float(lengths.sum())
        way_m = max(0.0, t_s - self.after_s) * self.speed_m_s
        ended = self.repeat == "once" and way_m >= whole_m
        along_m = whole_m if ended else way_m % whole_m
        ends = np.cumsum(lengths)
        leg = min(int(np.searchsorted(ends, along_m, side="right")), len(lengths) - 1)
        unit = steps[leg] / lengths[leg]
        place = points[leg + 1] - unit * (ends[leg] - along_m)
        speed = 0.0 if ended or t_s < self.after_s else self.speed_m_s
        return _pair(place), _pair(unit * speed)

    def _round(self) -> np.ndarray:
        """(N, 2) the way until it begins anew."""
        points = list(self.points_m)
        if self.repeat == "back_and_forth":
            points += points[-2::-1]
        elif self.repeat == "around" and math.dist(points[0], points[-1]) > 0.0:
            points.append(points[0])
        return np.array(points, np.float64)


def _pair(values: np.ndarray) -> Pair:
    return float(values[0]), float(values[1])
