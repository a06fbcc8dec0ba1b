"""How the simulated multirotor moves: a point mass that tilts to accelerate, in wind with its gusts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from telemetry.simulation.simulator.neu_frame import Vec3

GRAVITY_M_S2 = 9.80665
GUST_SHARE = 0.15
"""Standard deviation of gusts over the steady speed."""
GUST_S = 3.0
"""Correlation time of gusts."""
HEADING_BIAS_RAD = math.radians(0.5)
"""At most, to either side; constant for a flight."""
LEVEL_SIGMA_RAD = math.radians(0.2)


@dataclass(frozen=True, slots=True)
class Airframe:
    """Limits of a quadcopter of about 3 kg."""

    max_tilt_rad: float = math.radians(30.0)
    max_thrust_m_s2: float = 2.0 * GRAVITY_M_S2
    drag_per_s: float = 0.265
    drag_per_m: float = 0.022
    """Deceleration over airspeed, and how it grows with that: from lean and speed of three recorded flights of
    ArduCopter's own simulation, up to 9 m/s."""
    tilt_rate_rad_s: float = 12.0
    """Natural frequency of the attitude loop, critically damped."""
    thrust_lag_s: float = 0.05
    max_yaw_rate_rad_s: float = math.radians(60.0)


@dataclass(frozen=True, slots=True)
class Demand:
    """What the autopilot wants of the airframe."""

    accel_neu: Vec3
    """Acceleration over the ground, m/s^2"""
    heading_rad: float


class Multirotor:
    """True motion, stepped with a fixed time step. Heights are metres above the frame's origin."""

    def __init__(self, airframe: Airframe, heading_rad: float = 0.0) -> None:
        self.airframe = airframe
        self.p_neu: Vec3 = (0.0, 0.0, 0.0)
        self.v_neu: Vec3 = (0.0, 0.0, 0.0)
        self.accel_neu: Vec3 = (0.0, 0.0, 0.0)
        self.heading_rad = heading_rad
        self.yaw_rate_rad_s = 0.0
        self.lean: tuple[float, float] = (0.0, 0.0)
        """Horizontal specific force, m/s^2 north and east: where the rotors pull."""
        self._lean_rate: tuple[float, float] = (0.0, 0.0)
        self._thrust_m_s2 = 0.0

    def step(self, demand: Demand | None, wind_neu: Vec3, dt_s: float) -> None:
        """One free-flight step; without a demand the motors stand still."""
        if demand is None:
            self._thrust_m_s2, self.lean, self._lean_rate = 0.0, (0.0, 0.0), (0.0, 0.0)
            self.yaw_rate_rad_s = 0.0
        else:
            self._turn(demand.heading_rad, dt_s)
            self._lean_towards(demand.accel_neu, dt_s)
            self._push(demand.accel_neu[2], dt_s)
        self._move(wind_neu, dt_s)

    def rest_on(self, up_m: float, *, sliding: bool = False) -> None:
        """Stand on the ground at this height."""
        self.p_neu = (self.p_neu[0], self.p_neu[1], up_m)
        self.v_neu = (self.v_neu[0], self.v_neu[1], 0.0) if sliding else (0.0, 0.0, 0.0)
        self.accel_neu = (0.0, 0.0, 0.0)
        self.lean, self._lean_rate = (0.0, 0.0), (0.0, 0.0)
        self.yaw_rate_rad_s = 0.0

    @property
    def attitude_rad(self) -> Vec3:
        """Roll, pitch, heading."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        forward, right = self.lean[0] * c + self.lean[1] * s, -self.lean[0] * s + self.lean[1] * c
        pitch = -math.atan2(forward, GRAVITY_M_S2)
        return math.atan2(right * math.cos(pitch), GRAVITY_M_S2), pitch, self.heading_rad

    def _turn(self, heading_rad: float, dt_s: float) -> None:
        off = math.remainder(heading_rad - self.heading_rad, 2 * math.pi)
        limit = self.airframe.max_yaw_rate_rad_s
        rate = max(-limit, min(limit, 4.0 * off))
        self.yaw_rate_rad_s += (rate - self.yaw_rate_rad_s) * min(1.0, dt_s / 0.1)
        self.heading_rad = (self.heading_rad + self.yaw_rate_rad_s * dt_s) % (2 * math.pi)

    def _lean_towards(self, accel_neu: Vec3, dt_s: float) -> None:
        north, east = accel_neu[0], accel_neu[1]
        most = GRAVITY_M_S2 * math.tan(self.airframe.max_tilt_rad)
        size = math.hypot(north, east)
        if size > most:
            north, east = north * most / size, east * most / size
        w = self.airframe.tilt_rate_rad_s
        (x, y), (vx, vy) = self.lean, self._lean_rate
        vx += (w * w * (north - x) - 2 * w * vx) * dt_s
        vy += (w * w * (east - y) - 2 * w * vy) * dt_s
        self.lean, self._lean_rate = (x + vx * dt_s, y + vy * dt_s), (vx, vy)

    def _push(self, up_m_s2: float, dt_s: float) -> None:
        wanted = max(0.0, min(self.airframe.max_thrust_m_s2, up_m_s2 + GRAVITY_M_S2))
        self._thrust_m_s2 += (wanted - self._thrust_m_s2) * min(1.0, dt_s / self.airframe.thrust_lag_s)

    def _move(self, wind_neu: Vec3, dt_s: float) -> None:
        (vn, ve, vu), (wn, we, wu) = self.v_neu, wind_neu
        air_n, air_e, air_u = vn - wn, ve - we, vu - wu
        k = self.airframe.drag_per_s + self.airframe.drag_per_m * math.hypot(air_n, air_e, air_u)
        an = self.lean[0] - k * air_n
        ae = self.lean[1] - k * air_e
        au = self._thrust_m_s2 - GRAVITY_M_S2 - k * air_u
        vn, ve, vu = vn + an * dt_s, ve + ae * dt_s, vu + au * dt_s
        n, e, u = self.p_neu
        self.accel_neu, self.v_neu = (an, ae, au), (vn, ve, vu)
        self.p_neu = (n + vn * dt_s, e + ve * dt_s, u + vu * dt_s)


def quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """w x y z of a rotation from north-east-down to the body."""
    cr, sr, cp, sp = math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


class Wind:
    """Gusts follow a first-order Gauss-Markov process per axis; the vertical one is half as strong."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._gust = [0.0, 0.0, 0.0]

    def step(self, speed_m_s: float, from_rad: float, dt_s: float) -> Vec3:
        """Velocity of the air, north east up, for a steady wind that blows from ``from_rad``."""
        if speed_m_s <= 0:
            return 0.0, 0.0, 0.0
        keep = math.exp(-dt_s / GUST_S)
        spread = GUST_SHARE * speed_m_s * math.sqrt(1 - keep * keep)
        kicks = self._rng.standard_normal(3).tolist()
        self._gust = [keep * gust + spread * kick for gust, kick in zip(self._gust, kicks, strict=True)]
        north, east, up = self._gust
        return north - speed_m_s * math.cos(from_rad), east - speed_m_s * math.sin(from_rad), up / 2


@dataclass(frozen=True, slots=True)
class AttitudeError:
    """Reported minus true."""

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    heading_rad: float = 0.0

    @classmethod
    def drawn(cls, random: np.random.Generator) -> AttitudeError:
        roll, pitch = (LEVEL_SIGMA_RAD * np.clip(random.standard_normal(2), -2, 2)).tolist()
        return cls(roll, pitch, float(random.uniform(-HEADING_BIAS_RAD, HEADING_BIAS_RAD)))

    def reported(self, true_rad: Vec3) -> Vec3:
        """Roll, pitch, heading."""
        roll, pitch, heading = true_rad
        return roll + self.roll_rad, pitch + self.pitch_rad, (heading + self.heading_rad) % (2 * math.pi)
