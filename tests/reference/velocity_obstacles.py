"""Velocity obstacles by trying: ways stepped through time, velocities tried one by one (Wessendorp 2021, III-C)."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64


def closest_m(offset: F64, relative: F64, *, until_s: float, step_s: float) -> float:
    """Between the middles of two that go straight on; ``relative`` is the vehicle's velocity seen from the obstacle."""
    best = math.inf
    for k in range(int(until_s / step_s) + 1):
        away = offset - relative * (k * step_s)
        best = min(best, math.hypot(away[0], away[1]))
    return best


def in_collision_cone(offset: F64, relative: F64, radius: float) -> bool:
    """Fig. 3: the angle between the relative velocity and the obstacle is less than asin(radius / range)."""
    range_m, speed = math.hypot(*offset), math.hypot(*relative)
    if speed == 0.0:
        return False
    cosine = float(offset @ relative) / (range_m * speed)
    return math.acos(max(-1.0, min(1.0, cosine))) < math.asin(radius / range_m)


def nearest_free(
    wanted: F64, offsets: F64, velocities: F64, radii: F64, *, max_speed_m_s: float, max_turn_rad: float, steps: int
) -> float:
    """How far the nearest allowed velocity of a square grid is from the wanted one; infinite if there is none."""
    best = math.inf
    heading = math.atan2(wanted[0], wanted[1])
    for east in np.linspace(-max_speed_m_s, max_speed_m_s, steps):
        for north in np.linspace(-max_speed_m_s, max_speed_m_s, steps):
            tried = np.array([east, north])
            turn = abs(math.remainder(math.atan2(east, north) - heading, 2 * math.pi))
            if math.hypot(east, north) > max_speed_m_s or turn > max_turn_rad:
                continue
            pairs = zip(offsets, velocities, radii, strict=True)
            if not any(in_collision_cone(offset, tried - velocity, radius) for offset, velocity, radius in pairs):
                best = min(best, math.hypot(*(tried - wanted)))
    return best
