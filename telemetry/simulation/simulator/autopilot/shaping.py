"""A target that moves to where it is wanted with limited speed, acceleration and jerk.

ArduCopter leads its position controller this way in GUIDED, LOITER, take-off, return and landing.
"""

from __future__ import annotations

import math
from dataclasses import replace

from planning.flight_time.scurve import Axes
from telemetry.simulation.simulator.autopilot.leg_curves import REST
from telemetry.simulation.simulator.neu_frame import Vec3

JERK_M_S3 = 5.0
"""ArduCopter's PSC_JERK_XY and PSC_JERK_Z."""
BRAKING_SHARE = 0.57
"""Vertical deceleration on the last metres of a landing over the highest acceleration, from the recorded flights."""
NEAR_PER_S = 2.0
"""Speed over distance there."""
APPROACH_SHARE = 0.5
"""Of acceleration and of its response to a difference of speed, for the approach to a place: ArduCopter's own."""
BRAKE_ACCEL_M_S2 = 7.5
"""ArduCopter's BRAKE_MODE_DECEL_RATE. Its shaper takes so much only of speeds above 11 m/s, for the jerk's sake: the
vehicle nearly always glides to a halt, as recorded."""
CORNER_SHARE = math.sqrt(0.5)
"""Of the highest acceleration, kept for what is across the wished velocity: ArduCopter's own. Without it a corner is
cut about twice as far as recorded."""
AT_REST_M_S = 0.02
STOPPING_STEP_S = 0.02
LONGEST_STOP = 1000


def approach_speed(distance_m: float, decel_m_s2: float) -> float:
    """Speed from which the rest of the way can be braked: linear near the end, a square root before."""
    linear_m = decel_m_s2 / NEAR_PER_S**2
    if distance_m <= linear_m:
        return NEAR_PER_S * distance_m
    return math.sqrt(2 * decel_m_s2 * (distance_m - linear_m / 2))


def controlled(error: float, per_s: float, limit: float) -> float:
    """ArduPilot's ``sqrt_controller``: proportional to a small error, to the root of what exceeds it."""
    linear = limit / per_s**2
    size = abs(error)
    return math.copysign(per_s * size if size <= linear else math.sqrt(2 * limit * (size - linear / 2)), error)


class Shaped:
    """Position, velocity and acceleration of a target, north east up."""

    def __init__(self, p_neu: Vec3, v_neu: Vec3 = REST, accel_neu: Vec3 = REST) -> None:
        self.p_neu, self.v_neu, self.accel_neu = p_neu, v_neu, accel_neu

    def towards(self, goal_neu: Vec3, axes: Axes, dt_s: float) -> None:
        """One step to a place, as straight as the limits of climb allow."""
        axes = _along(goal_neu, self.p_neu, axes)
        up_m_s = self._vertical_speed(goal_neu[2] - self.p_neu[2], axes)
        self._step(self._flat_velocity(goal_neu, axes), up_m_s, axes, dt_s)

    def following(self, goal_neu: Vec3, v_neu: Vec3, axes: Axes, dt_s: float) -> None:
        """One step after a place that moves at this velocity."""
        north, east = self._flat_velocity(goal_neu, axes)
        up_m_s = self._vertical_speed(goal_neu[2] - self.p_neu[2], axes)
        self._step((north + v_neu[0], east + v_neu[1]), up_m_s + v_neu[2], axes, dt_s)

    def moving(self, v_neu: Vec3, axes: Axes, dt_s: float) -> None:
        """One step at this velocity, or as fast as the limits allow."""
        north, east = limited(v_neu[0], v_neu[1], axes.speed_m_s)
        self._step((north, east), max(-axes.descent_m_s, min(axes.climb_m_s, v_neu[2])), axes, dt_s)

    def sinking(self, over_neu: Vec3, speed_m_s: float, axes: Axes, dt_s: float) -> None:
        """One step down at this speed over a place, whatever its height."""
        self._step(self._flat_velocity(over_neu, axes), -speed_m_s, axes, dt_s)

    def stop(self, axes: Axes, dt_s: float) -> None:
        """One step of braking, wherever that ends."""
        self._step((0.0, 0.0), 0.0, axes, dt_s)

    def brake(self, axes: Axes, dt_s: float) -> None:
        """One step of the flight mode BRAKE."""
        self._step((0.0, 0.0), 0.0, replace(axes, accel_m_s2=BRAKE_ACCEL_M_S2), dt_s)

    @property
    def at_rest(self) -> bool:
        return math.hypot(*self.v_neu) < AT_REST_M_S and math.hypot(*self.accel_neu) < 10 * AT_REST_M_S

    @property
    def motion(self) -> tuple[Vec3, Vec3, Vec3]:
        return self.p_neu, self.v_neu, self.accel_neu

    def _flat_velocity(self, goal_neu: Vec3, axes: Axes) -> tuple[float, float]:
        north, east = goal_neu[0] - self.p_neu[0], goal_neu[1] - self.p_neu[1]
        distance = math.hypot(north, east)
        if distance < 1e-6:
            return 0.0, 0.0
        speed = min(axes.speed_m_s, _approach(distance, axes.accel_m_s2))
        return speed * north / distance, speed * east / distance

    def _vertical_speed(self, away_m: float, axes: Axes) -> float:
        speed = _approach(abs(away_m), axes.vertical_accel_m_s2)
        return min(speed, axes.climb_m_s) if away_m > 0 else -min(speed, axes.descent_m_s)

    def _step(self, flat_m_s: tuple[float, float], up_m_s: float, axes: Axes, dt_s: float) -> None:
        (an, ae, au), (vn, ve, vu), (n, e, u) = self.accel_neu, self.v_neu, self.p_neu
        north, east = _flat_wish(flat_m_s, (flat_m_s[0] - vn, flat_m_s[1] - ve), axes.accel_m_s2)
        up = _between(_wish(up_m_s - vu, axes.vertical_accel_m_s2), axes.vertical_accel_m_s2)
        dn, de = limited(north - an, east - ae, JERK_M_S3 * dt_s)
        step = JERK_M_S3 * dt_s
        an, ae, au = an + dn, ae + de, au + _between(up - au, step)
        vn, ve, vu = vn + an * dt_s, ve + ae * dt_s, vu + au * dt_s
        self.accel_neu, self.v_neu = (an, ae, au), (vn, ve, vu)
        self.p_neu = (n + vn * dt_s, e + ve * dt_s, u + vu * dt_s)


def _along(goal_neu: Vec3, p_neu: Vec3, axes: Axes) -> Axes:
    """The limits of speed on a straight line to the goal: the axis that binds first slows the other."""
    flat, up = math.hypot(goal_neu[0] - p_neu[0], goal_neu[1] - p_neu[1]), goal_neu[2] - p_neu[2]
    length = math.hypot(flat, up)
    if length < 1e-6:
        return axes
    vertical = axes.climb_m_s if up > 0 else axes.descent_m_s
    speed = min(axes.speed_m_s * length / flat if flat else math.inf, vertical * length / abs(up) if up else math.inf)
    vertical, flat_m_s = speed * abs(up) / length, speed * flat / length
    # Asked for in nearly every step of a flight: dataclasses.replace takes half as long again.
    return Axes(
        flat_m_s,
        vertical,
        vertical,
        axes.accel_m_s2,
        axes.vertical_accel_m_s2,
        axes.corner_accel_m_s2,
        axes.jerk_m_s3,
    )


def _approach(distance_m: float, accel_m_s2: float) -> float:
    """Speed towards a place."""
    per_s = APPROACH_SHARE * JERK_M_S3 / accel_m_s2
    return controlled(distance_m, per_s, APPROACH_SHARE * accel_m_s2)


def _wish(change_m_s: float, accel_m_s2: float) -> float:
    """Acceleration that ends a difference of speed; may exceed the highest, ``accel_m_s2``."""
    return controlled(change_m_s, JERK_M_S3 / accel_m_s2, JERK_M_S3)


def _flat_wish(
    goal_m_s: tuple[float, float], change_m_s: tuple[float, float], accel_m_s2: float
) -> tuple[float, float]:
    """The same in the plane: what is across the wished velocity comes before what is along it."""
    size, speed = math.hypot(*change_m_s), math.hypot(*goal_m_s)
    if size < 1e-9:
        return 0.0, 0.0
    accel = _wish(size, accel_m_s2)
    north, east = accel * change_m_s[0] / size, accel * change_m_s[1] / size
    if speed < 1e-9:
        return limited(north, east, accel_m_s2)
    un, ue = goal_m_s[0] / speed, goal_m_s[1] / speed
    along, across = north * un + east * ue, east * un - north * ue
    if abs(across) >= abs(along):
        return limited(north, east, accel_m_s2)
    across = _between(across, CORNER_SHARE * accel_m_s2)
    along = _between(along, math.sqrt(accel_m_s2**2 - across**2))
    return along * un - across * ue, along * ue + across * un


def _between(value: float, most: float) -> float:
    return max(-most, min(most, value))


def limited(north: float, east: float, most: float) -> tuple[float, float]:
    size = math.hypot(north, east)
    return (north, east) if size <= most else (north * most / size, east * most / size)


def stopping_point(shaped: Shaped, axes: Axes) -> Vec3:
    """Where a target that brakes now comes to rest."""
    ahead = Shaped(*shaped.motion)
    for _ in range(LONGEST_STOP):
        if ahead.at_rest:
            break
        ahead.stop(axes, STOPPING_STEP_S)
    return ahead.p_neu
