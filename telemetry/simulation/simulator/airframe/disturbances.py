"""Wind over the simulated world: a steady part and gusts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from telemetry.simulation.simulator.neu_frame import Vec3

GUST_SHARE = 0.15
"""Standard deviation of gusts over the steady speed."""
GUST_S = 3.0
"""Correlation time of gusts."""


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
