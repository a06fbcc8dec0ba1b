"""A chain of legs as PX4 flies it: corners at a speed that their angle allows, braking in time for each."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from planning.flight_time.scurve import Axes

STRAIGHT_RAD = math.radians(1.0)


def corner_leg_times(points_m: F64, hold_s: F64, speed_m_s: F64, axes: Axes, radius_m: float) -> F64:
    """Seconds (K,) from the first waypoint's departure to each waypoint reached and its hold over.

    PX4's position smoothing limits the speed at a waypoint to ``sqrt(a r tan(alpha / 2))`` with
    ``alpha`` the inner angle between the legs seen from above (pi when straight on), ``r`` the acceptance
    radius and ``a`` the acceleration, and speeds up and brakes between waypoints. We let v^2
    change by at most ``2 a L`` per leg and add the time that limited jerk costs, ``a / jerk``,
    for each change of speed in proportion to it.
    """
    deltas = np.diff(points_m, axis=0)
    lengths = np.linalg.norm(deltas, axis=1)
    legs = np.flatnonzero(lengths > 1e-6)
    allowed = np.array([_along(deltas[i] / lengths[i], speed_m_s[i], axes) for i in legs])
    node = np.zeros(len(legs) + 1)
    for k in range(1, len(legs)):
        if not hold_s[legs[k - 1] + 1 : legs[k] + 1].any():
            turn = _turn_speed(deltas[legs[k - 1]], deltas[legs[k]], axes, radius_m)
            node[k] = min(turn, allowed[k - 1], allowed[k])
    node = _reachable(node, lengths[legs], axes.accel_m_s2)
    seconds = np.zeros(len(deltas))
    for k, i in enumerate(legs):
        seconds[i] = _leg_s(lengths[i], node[k], node[k + 1], allowed[k], axes)
    return np.concatenate([[0.0], np.cumsum(seconds + hold_s[1:])])


def _along(direction: F64, speed_m_s: float, axes: Axes) -> float:
    flat, up = math.hypot(direction[0], direction[1]), float(direction[2])
    vertical_m_s = axes.climb_m_s if up > 0 else axes.descent_m_s
    return min(speed_m_s / flat if flat else math.inf, vertical_m_s / abs(up) if up else math.inf)


def _turn_speed(before: F64, after: F64, axes: Axes, radius_m: float) -> float:
    heading = math.atan2(before[0], before[1]) - math.atan2(after[0], after[1])
    inner_rad = math.pi - abs(math.remainder(heading, 2 * math.pi))
    if math.pi - inner_rad < STRAIGHT_RAD:
        return math.inf
    return math.sqrt(axes.accel_m_s2 * radius_m * math.tan(inner_rad / 2))


def _reachable(node_m_s: F64, lengths_m: F64, accel_m_s2: float) -> F64:
    """Node speeds lowered until each can be reached from the one before and braked from for the next."""
    place = 2 * accel_m_s2 * np.concatenate([[0.0], np.cumsum(lengths_m)])
    squared = np.minimum.accumulate(node_m_s**2 - place) + place
    squared = np.minimum.accumulate((squared + place)[::-1])[::-1] - place
    return np.sqrt(np.maximum(squared, 0.0))


def _leg_s(length_m: float, start_m_s: float, end_m_s: float, top_m_s: float, axes: Axes) -> float:
    a = axes.accel_m_s2
    peak = min(top_m_s, math.sqrt(a * length_m + (start_m_s**2 + end_m_s**2) / 2))
    blends_m = (2 * peak**2 - start_m_s**2 - end_m_s**2) / (2 * a)
    change_m_s = 2 * peak - start_m_s - end_m_s
    jerk_s = a / axes.jerk_m_s3 * change_m_s / (2 * peak)
    return change_m_s / a + max(0.0, length_m - blends_m) / peak + jerk_s
