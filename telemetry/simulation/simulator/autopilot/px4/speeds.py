"""How fast PX4 may fly towards a waypoint for what comes after it: its own limits at corners, and for braking."""

from __future__ import annotations

import math
from dataclasses import dataclass

from telemetry.simulation.simulator.neu_frame import Vec3

SAME_M = 0.001
STRAIGHT_RAD = 1e-6


@dataclass(frozen=True, slots=True)
class SpeedLimits:
    cruise_m_s: float
    accel_m_s2: float
    jerk_m_s3: float
    radius_m: float
    """NAV_ACC_RAD"""
    height_radius_m: float
    """NAV_MC_ALT_RAD"""
    corner_share: float
    """MPC_XY_TRAJ_P: of the acceleration, at corners."""


def before_braking(distance_m: float, end_m_s: float, accel_m_s2: float, jerk_m_s3: float) -> float:
    """The speed from which ``end_m_s`` can be had within a distance, counting the time that the jerk costs."""
    b = 4 * accel_m_s2**2 / jerk_m_s3
    c = -2 * accel_m_s2 * distance_m - end_m_s**2
    return max(end_m_s, (math.sqrt(b * b - 4 * c) - b) / 2)


def braking_distance_m(speed_m_s: float, accel_m_s2: float, jerk_m_s3: float) -> float:
    """To where PX4 puts the place of HOLD when it is ordered on the way."""
    return speed_m_s * (speed_m_s / (2 * accel_m_s2) + accel_m_s2 / jerk_m_s3)


def through_corner(start: Vec3, corner: Vec3, following: Vec3, accel_m_s2: float, radius_m: float) -> float:
    """Seen from above."""
    one, other = (start[0] - corner[0], start[1] - corner[1]), (following[0] - corner[0], following[1] - corner[1])
    return _turning(one, other, accel_m_s2, radius_m)


def towards(start: Vec3, goal: Vec3, following: Vec3, limits: SpeedLimits) -> float:
    """Over ground, at ``start``."""
    beyond_m_s = 0.0
    for first, second, third in (
        (following, following, following),
        (goal, following, following),
        (start, goal, following),
    ):
        beyond_m_s = _at_start(first, second, third, beyond_m_s, limits)
    return beyond_m_s


def vertical(start: Vec3, now_up_m: float, goal: Vec3, following: Vec3, limits: SpeedLimits, most_m_s: float) -> float:
    """Up or down, at the height ``now_up_m``. PX4's own corner counts horizontal distances from the frame's origin."""
    end_m_s = 0.0
    if abs(goal[2] - following[2]) > SAME_M:
        s, g, f = (math.hypot(p[0], p[1]) for p in (start, goal, following))
        one, other = (g - s, goal[2] - start[2]), (g - f, goal[2] - following[2])
        end_m_s = min(
            most_m_s, _turning((-one[0], -one[1]), (-other[0], -other[1]), limits.accel_m_s2, limits.height_radius_m)
        )
    return min(most_m_s, before_braking(abs(goal[2] - now_up_m), end_m_s, limits.accel_m_s2, limits.jerk_m_s3))


def _at_start(start: Vec3, goal: Vec3, following: Vec3, exit_m_s: float, limits: SpeedLimits) -> float:
    beyond_m = math.dist(goal[:2], following[:2])
    there_m_s = 0.0
    if beyond_m > SAME_M and beyond_m >= limits.radius_m:
        corner = through_corner(start, goal, following, limits.corner_share * limits.accel_m_s2, limits.radius_m)
        there_m_s = min(corner, exit_m_s, limits.cruise_m_s)
    away_m = math.dist(start[:2], goal[:2])
    return min(limits.cruise_m_s, before_braking(away_m, there_m_s, limits.accel_m_s2, limits.jerk_m_s3))


def _turning(one: tuple[float, float], other: tuple[float, float], accel_m_s2: float, radius_m: float) -> float:
    """``one`` and ``other``: from the corner to the points before and after it."""
    size = math.hypot(*one) * math.hypot(*other)
    cosine = (one[0] * other[0] + one[1] * other[1]) / size if size > 0 else 0.0
    inner_rad = min(math.acos(max(-1.0, min(1.0, cosine))), math.pi - STRAIGHT_RAD)
    return math.sqrt(accel_m_s2 * radius_m * math.tan(inner_rad / 2))
