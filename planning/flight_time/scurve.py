"""A straight leg as ArduCopter flies it: from rest to rest with limited speed, acceleration, jerk and snap."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mapping.geometry.arrays import F64

INPUT_TIME_CONSTANT_S = 0.15
"""ArduCopter's ATC_INPUT_TC; half its snap is what the S-curves use, so jerk ramps take twice as long."""
NEWTON_STEPS = 12
OVERLAP_STEPS = 200


@dataclass(frozen=True, slots=True)
class LegLimits:
    """Along the leg."""

    speed_m_s: float
    accel_m_s2: float
    jerk_m_s3: float


@dataclass(frozen=True, slots=True)
class Speeding:
    """From rest to ``speed_m_s``: a jerk pulse up, constant acceleration, a jerk pulse down.

    A pulse rises and falls as a raised cosine of ``ramp_s`` around ``flat_s`` of ``jerk_m_s3``.
    """

    jerk_m_s3: float
    ramp_s: float
    flat_s: float
    steady_s: float

    @property
    def pulse_s(self) -> float:
        return 2 * self.ramp_s + self.flat_s

    @property
    def accel_m_s2(self) -> float:
        return self.jerk_m_s3 * (self.ramp_s + self.flat_s)

    @property
    def duration_s(self) -> float:
        return 2 * self.pulse_s + self.steady_s

    @property
    def speed_m_s(self) -> float:
        return self.accel_m_s2 * (self.pulse_s + self.steady_s)

    @property
    def distance_m(self) -> float:
        """The speed rises point-symmetrically, so its mean is half of its end."""
        return self.speed_m_s * self.duration_s / 2

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Distance, speed and acceleration ``t_s`` after the start (from 0 to ``duration_s``)."""
        if t_s <= self.duration_s / 2:
            return self._first_half(t_s)
        distance, speed, accel = self._first_half(self.duration_s - t_s)
        return distance + self.speed_m_s * (t_s - self.duration_s / 2), self.speed_m_s - speed, accel

    def _first_half(self, t_s: float) -> tuple[float, float, float]:
        ramp, flat = self.ramp_s, self.flat_s
        x, v, a = _cosine_ramp(min(t_s, ramp), ramp, self.jerk_m_s3)
        x, v, a = _constant_jerk(x, v, a, self.jerk_m_s3, min(max(t_s - ramp, 0.0), flat))
        down_s = min(max(t_s - ramp - flat, 0.0), ramp)
        if down_s > 0:
            # Constant jerk less the rising ramp that would go with it.
            dx, dv, da = _cosine_ramp(down_s, ramp, self.jerk_m_s3)
            x, v, a = _constant_jerk(x, v, a, self.jerk_m_s3, down_s)
            x, v, a = x - dx, v - dv, a - da
        return _constant_jerk(x, v, a, 0.0, max(t_s - self.pulse_s, 0.0))


def _cosine_ramp(t_s: float, ramp_s: float, jerk_m_s3: float) -> tuple[float, float, float]:
    """Integrals of ``jerk / 2 (1 - cos(pi t / ramp))`` from rest: distance, speed, acceleration."""
    if ramp_s <= 0:
        return 0.0, 0.0, 0.0
    half, w = jerk_m_s3 / 2, math.pi / ramp_s
    accel = half * (t_s - math.sin(w * t_s) / w)
    speed = half * (t_s**2 / 2 - (1 - math.cos(w * t_s)) / w**2)
    return half * (t_s**3 / 6 - t_s / w**2 + math.sin(w * t_s) / w**3), speed, accel


def _constant_jerk(x: float, v: float, a: float, jerk: float, t: float) -> tuple[float, float, float]:
    return x + t * (v + t * (a / 2 + t * jerk / 6)), v + t * (a + t * jerk / 2), a + t * jerk


def speed_up(half_length_m: float, limits: LegLimits) -> Speeding:
    """The fastest rise from rest within the limits that takes at most ``half_length_m``."""
    accel = min(_accel_to_speed(limits), _accel_to_distance(half_length_m, limits))
    if accel < limits.accel_m_s2:
        return _pulse(accel, limits.jerk_m_s3)
    strongest = _pulse(limits.accel_m_s2, limits.jerk_m_s3)
    a, p = strongest.accel_m_s2, strongest.pulse_s
    by_speed_s = limits.speed_m_s / a - p
    # a (p + t) (2 p + t) / 2 = half length, solved for the steady time t.
    by_length_s = (-3 * p + math.sqrt(p**2 + 8 * half_length_m / a)) / 2
    return Speeding(strongest.jerk_m_s3, strongest.ramp_s, strongest.flat_s, max(0.0, min(by_speed_s, by_length_s)))


def _accel_to_speed(limits: LegLimits) -> float:
    """Acceleration at which two pulses alone reach the set speed: ``v = a (a / j + r)``, or a weak pulse's ``v``."""
    jerk, ramp_s = limits.jerk_m_s3, 2 * INPUT_TIME_CONSTANT_S
    if limits.speed_m_s < 2 * jerk * ramp_s**2:
        snap = jerk / ramp_s
        return snap * (limits.speed_m_s / (2 * snap)) ** (2 / 3)
    return jerk * (math.sqrt(ramp_s**2 + 4 * limits.speed_m_s / jerk) - ramp_s) / 2


def _accel_to_distance(length_m: float, limits: LegLimits) -> float:
    """Acceleration at which two pulses alone take ``length_m = a (a / j + r)^2``, or a weak pulse's."""
    jerk, ramp_s = limits.jerk_m_s3, 2 * INPUT_TIME_CONSTANT_S
    if length_m < 4 * jerk * ramp_s**3:
        snap = jerk / ramp_s
        return snap * math.sqrt(length_m / (4 * snap))
    accel = (length_m * jerk**2) ** (1 / 3)
    # The cube is convex and the start lies above the root, so Newton's method descends to it.
    for _ in range(NEWTON_STEPS):
        p = accel / jerk + ramp_s
        accel -= (accel * p**2 - length_m) / (p**2 + 2 * accel * p / jerk)
    return accel


def _pulse(accel_m_s2: float, jerk_m_s3: float) -> Speeding:
    """The jerk pulses that just reach an acceleration; the snap limit lets weak ones have less jerk."""
    ramp_s = 2 * INPUT_TIME_CONSTANT_S
    if accel_m_s2 >= jerk_m_s3 * ramp_s:
        return Speeding(jerk_m_s3, ramp_s, accel_m_s2 / jerk_m_s3 - ramp_s, 0.0)
    snap = jerk_m_s3 / ramp_s
    ramp_s = math.sqrt(accel_m_s2 / snap)
    return Speeding(snap * ramp_s, ramp_s, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Leg:
    """A leg from rest to rest: ``rise``, cruise, and ``rise`` backwards."""

    direction: tuple[float, float, float]
    """Unit vector, x y z"""
    limits: LegLimits
    rise: Speeding
    cruise_s: float

    @property
    def duration_s(self) -> float:
        return 2 * self.rise.duration_s + self.cruise_s


@dataclass(frozen=True, slots=True)
class Axes:
    """What the autopilot allows horizontally and vertically."""

    speed_m_s: float
    climb_m_s: float
    descent_m_s: float
    accel_m_s2: float
    vertical_accel_m_s2: float
    corner_accel_m_s2: float
    jerk_m_s3: float


def leg(delta_m: F64, axes: Axes) -> Leg:
    """The leg along ``delta_m`` (3,), its limits those of the axis that binds first."""
    x, y, z = delta_m.tolist()
    length_m = math.hypot(x, y, z)
    flat, up = math.hypot(x, y) / length_m, z / length_m

    def along(horizontal: float, vertical: float) -> float:
        return min(horizontal / flat if flat else math.inf, vertical / abs(up) if up else math.inf)

    speed = along(axes.speed_m_s, axes.climb_m_s if up > 0 else axes.descent_m_s)
    limits = LegLimits(speed, along(axes.accel_m_s2, axes.vertical_accel_m_s2), axes.jerk_m_s3)
    rise = speed_up(length_m / 2, limits)
    cruise_s = max(0.0, length_m - 2 * rise.distance_m) / rise.speed_m_s
    return Leg((x / length_m, y / length_m, up), limits, rise, cruise_s)


def overlap_s(this: Leg, following: Leg, axes: Axes, *, radius_m: float) -> float:
    """How long before its end a leg is joined by the next: the corner that results must be gentle enough.

    Half way through the overlap the position must be within the waypoint radius, the speed below
    both legs' limits and the acceleration within the corner's. The autopilot tries at every
    control step, from the latest of this leg's braking and as long as the next takes to speed up.
    """
    longest_s = min(this.rise.duration_s, following.rise.duration_s)
    slower_m_s = min(this.limits.speed_m_s, following.limits.speed_m_s)
    for step in range(OVERLAP_STEPS, 0, -1):
        tried_s = longest_s * step / OVERLAP_STEPS
        x0, v0, a0 = this.rise.at(tried_s / 2)
        x1, v1, a1 = following.rise.at(tried_s / 2)
        if (
            math.hypot(*_sum(this, -x0, following, x1)) < radius_m
            and math.hypot(*_sum(this, v0, following, v1)) <= slower_m_s + 1e-6
            and math.hypot(*(accel := _sum(this, -a0, following, a1))[:2]) < axes.corner_accel_m_s2
            and abs(accel[2]) < axes.vertical_accel_m_s2
        ):
            return tried_s
    return 0.0


def _sum(this: Leg, a: float, following: Leg, b: float) -> tuple[float, float, float]:
    (x0, y0, z0), (x1, y1, z1) = this.direction, following.direction
    return x0 * a + x1 * b, y0 * a + y1 * b, z0 * a + z1 * b
