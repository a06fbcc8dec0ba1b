"""What disturbs the simulated vehicle: wind with its gusts, and how wrong its own idea of its attitude is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from telemetry.simulation.simulator.neu_frame import Vec3

GUST_SHARE = 0.15
"""Standard deviation of gusts over the steady speed."""
GUST_S = 3.0
"""Correlation time of gusts."""
HEADING_BIAS_RAD = math.radians(0.5)
"""At most, to either side; constant for a flight."""
LEVEL_SIGMA_RAD = math.radians(0.2)


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
