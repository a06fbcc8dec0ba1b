"""What a velocity comes to when the vehicle needs time to change to it, and the one that leaves the most room.

A velocity obstacle holds for who flies the new velocity at once. Near an obstacle that is not so: the way that the
change takes may lead into it (acceleration-velocity obstacles, van den Berg, Snape, Guy and Manocha 2011).
"""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from planning.evading.velocity_obstacles import Limits, Obstacles

ACCEL_M_S2 = 2.0
"""Of the change: ArduCopter's 2.5, less what its limited jerk takes."""
HORIZON_S, STEP_S = 4.0, 0.2
SPEEDS, DIRECTIONS = 6, 32
DEVIATION = 0.05
"""What a whole cruising speed beside the wanted velocity counts, against coming nearer by the whole radius."""


def shortfall(obstacles: Obstacles, velocity: F64, candidates: F64) -> F64:
    """(K,) By which share of its radius an obstacle is come too near, the worst of all, on the way to each candidate.

    ``velocity`` (2,) the present one, ``candidates`` (K, 2). 0: everything is kept.
    """
    if not len(obstacles.obstacles_enu_m):
        return np.zeros(len(candidates))
    t_s = np.arange(STEP_S, HORIZON_S + STEP_S / 2, STEP_S)
    own = _places(velocity, candidates, t_s)
    rate = obstacles.velocities_enu_m_s[:, None]
    away = obstacles.offset_enu_m[:, None] + t_s[None, :, None] * rate - own[:, None]
    nearest_m = np.sqrt((away * away).sum(axis=-1)).min(axis=-1)
    radius_m = np.maximum(obstacles.radius_m, 1e-6)
    return np.maximum(0.0, 1.0 - nearest_m / radius_m).max(axis=-1)


def roomiest(obstacles: Obstacles, onward: F64, velocity: F64, limits: Limits, *, also: F64 | None = None) -> F64:
    """(2,) Of a grid of velocities within the limits, and ``also``, the one that comes least too near to anything."""
    found = _grid(onward, limits)
    if also is not None:
        found = np.vstack([also, found])
    beside = np.hypot(*(found - onward).T) / max(math.hypot(*onward), 1e-6)
    return found[np.argmin(shortfall(obstacles, velocity, found) + DEVIATION * beside)]


def _places(velocity: F64, candidates: F64, t_s: F64) -> F64:
    """(K, T, 2) The velocity changes straight to each candidate, and stays there."""
    change = candidates - velocity
    amount = np.hypot(*change.T)
    took_s = amount / ACCEL_M_S2
    unit = change / np.maximum(amount, 1e-9)[:, None]
    during_s = np.minimum(t_s, took_s[:, None])
    gained_m = ACCEL_M_S2 * (0.5 * during_s**2 + during_s * (t_s - during_s))
    return t_s[None, :, None] * velocity + gained_m[..., None] * unit[:, None]


def _grid(onward: F64, limits: Limits) -> F64:
    """(K, 2) Standing still, and speeds up to the greater of the wanted one and the limit in all allowed directions."""
    turn = min(limits.max_turn_rad, math.pi)
    angle = math.atan2(onward[0], onward[1]) + np.linspace(-turn, turn, DIRECTIONS + 1)
    speed = limits.max_speed_m_s * np.arange(1, SPEEDS + 1) / SPEEDS
    directions = np.column_stack([np.sin(angle), np.cos(angle)])
    return np.concatenate([np.zeros((1, 2)), (speed[:, None, None] * directions).reshape(-1, 2)])
