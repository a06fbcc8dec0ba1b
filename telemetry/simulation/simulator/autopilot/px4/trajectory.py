"""Where PX4's target is on its way through waypoints, as its position smoothing moves it.

It knows three places, the last one, the next one and the one after. Corners are cut within the acceptance radius; a
vehicle that lags behind slows the target's time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from telemetry.simulation.simulator.autopilot.leg_curves import Motion
from telemetry.simulation.simulator.autopilot.px4 import speeds
from telemetry.simulation.simulator.autopilot.px4.smoothing import Axis, end_together
from telemetry.simulation.simulator.autopilot.px4.speeds import SpeedLimits
from telemetry.simulation.simulator.neu_frame import Vec3

TURNING_COSINE, TURNING_FROM_M_S = 0.98, 0.2
SLOW_M_S = 0.5
LOOK_AHEAD_M = 5.0
"""On the leg, of a vehicle that turns into it."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What the trajectory may ask for."""

    cruise_m_s: float
    climb_m_s: float
    descent_m_s: float
    accel_m_s2: float
    accel_up_m_s2: float
    accel_down_m_s2: float
    jerk_m_s3: float
    radius_m: float
    height_radius_m: float
    corner_share: float
    furthest_m: float
    """MPC_XY_ERR_MAX: so far behind its target the vehicle stops it."""


class Trajectory:
    def __init__(self, p_neu: Vec3) -> None:
        self._axes = [Axis(value) for value in p_neu]
        self._speed_before_m_s = 0.0
        """Before a turn: it does not grow in the turn."""

    @property
    def p_neu(self) -> Vec3:
        north, east, up = self._axes
        return north.position_m, east.position_m, up.position_m

    @property
    def v_neu(self) -> Vec3:
        north, east, up = self._axes
        return north.speed_m_s, east.speed_m_s, up.speed_m_s

    @property
    def motion(self) -> Motion:
        north, east, up = self._axes
        return self.p_neu, self.v_neu, (north.accel_m_s2, east.accel_m_s2, up.accel_m_s2)

    def hold_height(self, up_m: float) -> None:
        self._axes[2].move_to(up_m)

    def reset(self, p_neu: Vec3) -> None:
        for axis, value in zip(self._axes, p_neu, strict=True):
            axis.reset(value)

    def towards(self, points: tuple[Vec3, Vec3, Vec3], at_neu: Vec3, limits: Limits, dt_s: float) -> None:
        """One step to the second of three points; ``at_neu``: where the vehicle is."""
        self._advance(at_neu, limits, dt_s)
        wish = self._wish(points, limits)
        self._limit(limits, upwards=wish[2] > 0)
        self._aim(wish)

    def at_velocity(self, v_neu: Vec3, at_neu: Vec3, limits: Limits, dt_s: float) -> None:
        """One step with this velocity."""
        self._advance(at_neu, limits, dt_s)
        self._limit(limits, upwards=v_neu[2] > 0)
        self._aim(v_neu)

    def over(self, place_neu: Vec3, up_m_s: float, at_neu: Vec3, limits: Limits, dt_s: float) -> None:
        """One step over a place, up or down at this speed."""
        self._advance(at_neu, limits, dt_s)
        n, e, u = self.p_neu
        north, east, _ = self._wish(
            ((n, e, u), (place_neu[0], place_neu[1], u), (place_neu[0], place_neu[1], u)), limits
        )
        self._limit(limits, upwards=up_m_s > 0)
        self._aim((north, east, up_m_s))

    def _advance(self, at_neu: Vec3, limits: Limits, dt_s: float) -> None:
        """The target waits for a vehicle that is behind it."""
        (n, e, _), (vn, ve, _) = self.p_neu, self.v_neu
        ahead_n, ahead_e = n - at_neu[0], e - at_neu[1]
        is_ahead = ahead_n * vn + ahead_e * ve >= 0
        flow = 1 - min(1.0, math.hypot(ahead_n, ahead_e) / limits.furthest_m) if is_ahead else 1.0
        for axis in self._axes:
            axis.step(dt_s * flow)

    def _limit(self, limits: Limits, *, upwards: bool) -> None:
        north, east, up = self._axes
        for axis in (north, east):
            axis.max_accel_m_s2, axis.max_speed_m_s = limits.accel_m_s2, math.inf
        up.max_accel_m_s2 = limits.accel_up_m_s2 if upwards else limits.accel_down_m_s2
        up.max_speed_m_s = limits.climb_m_s if upwards else limits.descent_m_s
        for axis in self._axes:
            axis.jerk_m_s3 = limits.jerk_m_s3

    def _aim(self, v_neu: Vec3) -> None:
        for axis, wish in zip(self._axes, v_neu, strict=True):
            axis.wish(wish)
        end_together(self._axes)

    def _wish(self, points: tuple[Vec3, Vec3, Vec3], limits: Limits) -> Vec3:
        """The velocity that leads to the next point."""
        start, goal, following = points
        p = self.p_neu
        flat_m_s = speeds.towards(p, goal, following, _flat(limits))
        most_m_s = limits.climb_m_s if goal[2] > p[2] else limits.descent_m_s
        up_m_s = speeds.vertical(start, p[2], goal, following, _upright(limits, up=goal[2] > p[2]), most_m_s)
        turning = self._is_turning(goal, limits)
        if turning:
            flat_m_s = min(flat_m_s, self._speed_before_m_s)
        else:
            self._speed_before_m_s = flat_m_s
        aim = self._on_leg(start, goal, limits) if turning else goal
        away = aim[0] - p[0], aim[1] - p[1], aim[2] - p[2]
        length = math.hypot(*away)
        if length < 1e-9:
            return 0.0, 0.0, 0.0
        speed = math.hypot(flat_m_s, up_m_s)
        wish = speed * away[0] / length, speed * away[1] / length, speed * away[2] / length
        return _slower_up(_slower_flat(wish, flat_m_s), up_m_s)

    def _is_turning(self, goal: Vec3, limits: Limits) -> bool:
        (n, e, _), (vn, ve, _) = self.p_neu, self.v_neu
        speed, away = math.hypot(vn, ve), (goal[0] - n, goal[1] - e)
        away_m = math.hypot(*away)
        if speed <= TURNING_FROM_M_S or away_m <= limits.radius_m:
            return False
        return (vn * away[0] + ve * away[1]) / (speed * away_m) < TURNING_COSINE

    def _on_leg(self, start: Vec3, goal: Vec3, limits: Limits) -> Vec3:
        """A point some metres ahead on the leg, to come back to it."""
        length = math.dist(start[:2], goal[:2])
        if length < 1e-9:
            return goal
        un, ue = (goal[0] - start[0]) / length, (goal[1] - start[1]) / length
        n, e, _ = self.p_neu
        along = (n - start[0]) * un + (e - start[1]) * ue
        beside = math.hypot(n - start[0] - along * un, e - start[1] - along * ue)
        reach = max(limits.radius_m, LOOK_AHEAD_M)
        along += math.sqrt(max(0.0, reach * reach - beside * beside))
        return start[0] + along * un, start[1] + along * ue, goal[2]


def _slower_flat(v_neu: Vec3, most_m_s: float) -> Vec3:
    """No faster over ground, straight on; where both are slow, without slowing what is up or down."""
    flat_m_s = math.hypot(v_neu[0], v_neu[1])
    if flat_m_s <= max(most_m_s, 1e-9):
        return v_neu
    share = most_m_s / flat_m_s
    return v_neu[0] * share, v_neu[1] * share, v_neu[2] * (1.0 if flat_m_s < SLOW_M_S else share)


def _slower_up(v_neu: Vec3, most_m_s: float) -> Vec3:
    if abs(v_neu[2]) <= max(most_m_s, 1e-9):
        return v_neu
    share = most_m_s / abs(v_neu[2])
    level = 1.0 if abs(v_neu[2]) < SLOW_M_S else share
    return v_neu[0] * level, v_neu[1] * level, v_neu[2] * share


def _flat(limits: Limits) -> SpeedLimits:
    return SpeedLimits(
        limits.cruise_m_s, limits.accel_m_s2, limits.jerk_m_s3, limits.radius_m, limits.height_radius_m,
        limits.corner_share,
    )  # fmt: skip


def _upright(limits: Limits, *, up: bool) -> SpeedLimits:
    accel = limits.accel_up_m_s2 if up else limits.accel_down_m_s2
    return SpeedLimits(
        limits.cruise_m_s, accel, limits.jerk_m_s3, limits.radius_m, limits.height_radius_m, limits.corner_share
    )
