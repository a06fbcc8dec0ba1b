"""The arena: two poles in the middle of a hall and ways through it from all sides and corners (Wessendorp 2021, IV)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64

HALF_M = 5.0
"""Of the hall's side."""
POLE_RADIUS_M = 0.25
VEHICLE_RADIUS_M = 0.2
"""Of a five-inch vehicle, rotors included."""
APART_M = (2.0, 3.5)
"""Between the poles' middles."""
OFF_AIM_M = 0.15


@dataclass(frozen=True, slots=True)
class Approach:
    """One way through the hall, in its own east and north from the hall's middle."""

    poles_enu_m: F64
    """(2, 2)"""
    start_enu_m: F64
    goal_enu_m: F64

    @property
    def heading_rad(self) -> float:
        return math.atan2(*(self.goal_enu_m - self.start_enu_m))

    @property
    def length_m(self) -> float:
        return float(np.hypot(*(self.goal_enu_m - self.start_enu_m)))

    def gap_m(self, place_enu_m: F64) -> float:
        """Between the hulls of a vehicle there and of the nearest pole; negative: they touch."""
        away = np.hypot(*(self.poles_enu_m - place_enu_m).T)
        return float(away.min()) - POLE_RADIUS_M - VEHICLE_RADIUS_M

    def gap_straight_on_m(self) -> float:
        """The same, the least on the straight way."""
        steps = np.linspace(0.0, 1.0, 400)[:, None]
        return min(self.gap_m(place) for place in self.start_enu_m + steps * (self.goal_enu_m - self.start_enu_m))


def approaches(count: int, random: np.random.Generator) -> list[Approach]:
    """Evenly from all around, each aimed at one of the poles, through the hall to its other side."""
    return [_approach(2 * math.pi * (k + random.uniform(-0.4, 0.4)) / count, random) for k in range(count)]


def _approach(from_rad: float, random: np.random.Generator) -> Approach:
    across, half = random.uniform(0.0, math.pi), random.uniform(*APART_M) / 2
    one = half * np.array([math.sin(across), math.cos(across)])
    poles = np.array([one, -one]) + random.normal(0.0, 0.2, 2)
    start = _on_wall(from_rad)
    aim = poles[random.integers(2)] - start
    direction = aim / np.hypot(*aim)
    aside = random.normal(0.0, OFF_AIM_M) * np.array([direction[1], -direction[0]])
    towards = aim + aside
    return Approach(poles, start, _leaving(start, towards / np.hypot(*towards)))


def _on_wall(bearing_rad: float) -> F64:
    """Where a ray from the middle meets the hall's wall."""
    unit = np.array([math.sin(bearing_rad), math.cos(bearing_rad)])
    return unit * (HALF_M / np.abs(unit).max())


def _leaving(start: F64, unit: F64) -> F64:
    """Where a ray from one wall meets another one."""
    with np.errstate(divide="ignore"):
        along = (np.sign(unit) * HALF_M - start) / unit
    return start + unit * along[np.isfinite(along)].min()
