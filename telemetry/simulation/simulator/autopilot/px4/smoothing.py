"""One axis of PX4's trajectory: a speed that changes with limited acceleration and jerk, in as little time as it takes.

Three phases: jerk, constant acceleration, jerk back; axes are brought to end together. PX4's VelocitySmoothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

TINY = 1e-9


class Axis:
    def __init__(self, position_m: float) -> None:
        self.position_m = position_m
        self.speed_m_s = self.accel_m_s2 = 0.0
        self.max_accel_m_s2, self.max_speed_m_s, self.jerk_m_s3 = 1.0, 1.0, 1.0
        self._wish_m_s = 0.0
        self._phases_s = (0.0, 0.0, 0.0)
        self._direction = 0.0
        self._begun = (position_m, 0.0, 0.0)
        self._since_s = 0.0

    @property
    def duration_s(self) -> float:
        return sum(self._phases_s)

    def reset(self, position_m: float, speed_m_s: float = 0.0, accel_m_s2: float = 0.0) -> None:
        self.position_m, self.speed_m_s, self.accel_m_s2 = position_m, speed_m_s, accel_m_s2
        self.wish(speed_m_s)

    def move_to(self, position_m: float) -> None:
        """To another place, without another motion."""
        _, v, a = self._begun
        self._begun = (self._begun[0] + position_m - self.position_m, v, a)
        self.position_m = position_m

    def step(self, dt_s: float) -> None:
        self._since_s += dt_s
        x, v, a = self._begun
        left_s, jerk = self._since_s, self.jerk_m_s3 * self._direction
        for phase_s, j in zip(self._phases_s, (jerk, 0.0, -jerk), strict=True):
            t = min(left_s, phase_s)
            x, v, a = x + v * t + a * t * t / 2 + j * t**3 / 6, v + a * t + j * t * t / 2, a + j * t
            left_s -= t
            if left_s <= 0:
                break
        if left_s > 0:
            x, a = x + v * left_s, 0.0
        self.position_m, self.speed_m_s, self.accel_m_s2 = x, v, a

    def wish(self, speed_m_s: float) -> None:
        """Towards another speed from now on."""
        self._wish_m_s = max(-self.max_speed_m_s, min(self.max_speed_m_s, speed_m_s))
        self._since_s, self._begun = 0.0, (self.position_m, self.speed_m_s, self.accel_m_s2)
        a0 = self.accel_m_s2
        missing = self._wish_m_s - (self.speed_m_s + a0 * abs(a0) / (2 * self.jerk_m_s3))
        self._direction = math.copysign(1.0, missing) if abs(missing) > TINY else _sign(a0)
        if not self._direction:
            self._phases_s = (0.0, 0.0, 0.0)
            return
        jerk, change = self._direction * self.jerk_m_s3, self._wish_m_s - self.speed_m_s
        first_s = self._limited(a0, jerk, _rise_s(a0, change, jerk))
        last_s = max(0.0, a0 / jerk + first_s)
        self._phases_s = (first_s, _between_s(first_s, last_s, a0, change, jerk), last_s)

    def last(self, duration_s: float) -> None:
        """The same change of speed, spread over a longer time."""
        if not self._direction:
            return
        a0, jerk = self.accel_m_s2, self._direction * self.jerk_m_s3
        rise_s = _rise_within_s(duration_s, a0, self._wish_m_s - self.speed_m_s, jerk)
        first_s = self._limited(a0, jerk, rise_s)
        last_s = max(0.0, a0 / jerk + first_s)
        self._phases_s = (first_s, max(0.0, duration_s - first_s - last_s), last_s)

    def _limited(self, a0: float, jerk: float, first_s: float) -> float:
        peak = a0 + jerk * first_s
        if abs(peak) > self.max_accel_m_s2:
            first_s = (math.copysign(self.max_accel_m_s2, peak) - a0) / jerk
        return max(0.0, first_s)


class Turn:
    """The heading that is asked for on the way to another one: it turns faster and slower at a limited rate."""

    def __init__(self) -> None:
        self.heading_rad = self._rate_rad_s = 0.0

    def reset(self, heading_rad: float) -> None:
        self.heading_rad, self._rate_rad_s = heading_rad, 0.0

    def step(self, goal_rad: float, dt_s: float, *, accel_rad_s2: float, fastest_rad_s: float) -> None:
        left_rad = math.remainder(goal_rad - self.heading_rad, math.tau)
        wish_rad_s = math.copysign(min(fastest_rad_s, math.sqrt(2 * accel_rad_s2 * abs(left_rad))), left_rad)
        change_rad_s = accel_rad_s2 * dt_s
        self._rate_rad_s += max(-change_rad_s, min(change_rad_s, wish_rad_s - self._rate_rad_s))
        self.heading_rad = (self.heading_rad + self._rate_rad_s * dt_s) % math.tau


def end_together(axes: Sequence[Axis]) -> None:
    longest = max(axes, key=lambda axis: axis.duration_s)
    for axis in axes:
        if axis is not longest:
            axis.last(longest.duration_s)


def _sign(value: float) -> float:
    return 0.0 if abs(value) < TINY else math.copysign(1.0, value)


def _rise_s(a0: float, change: float, jerk: float) -> float:
    """Of the first phase when there is no second one."""
    square = 2 * a0 * a0 + 4 * jerk * change
    if square < 0:
        return 0.0
    root = math.sqrt(square) / 2
    for first_s in ((-a0 + root) / jerk, (-a0 - root) / jerk):
        if first_s >= 0 and a0 / jerk + first_s >= 0:
            return first_s
    return 0.0


def _between_s(first_s: float, last_s: float, a0: float, change: float, jerk: float) -> float:
    accel = a0 + jerk * first_s
    if abs(accel) < TINY:
        return 0.0
    gained = a0 * first_s + jerk * first_s**2 / 2 + accel * last_s - jerk * last_s**2 / 2
    return max(0.0, (change - gained) / accel)


def _rise_within_s(duration_s: float, a0: float, change: float, jerk: float) -> float:
    """Of the first phase when all three take this long."""
    square = (duration_s * jerk) ** 2 + 2 * duration_s * a0 * jerk - a0 * a0 - 4 * jerk * change
    if square < 0:
        return 0.0
    middle, root = (jerk * duration_s - a0) / (2 * jerk), math.sqrt(square) / (2 * jerk)
    plus_s, minus_s = max(middle - root, 0.0), max(middle + root, 0.0)
    if plus_s + max(0.0, a0 / jerk + plus_s) > duration_s:
        return minus_s
    return plus_s if minus_s + max(0.0, a0 / jerk + minus_s) > duration_s else 0.0
