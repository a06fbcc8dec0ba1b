"""What keeps a hovering PX4 from standing still, and what moves its home in flight."""

from __future__ import annotations

import math

import numpy as np

from telemetry.simulation.simulator.neu_frame import Vec3

FLAT_M_S2, UPRIGHT_M_S2, LASTS_S = 0.35, 1.2, 1.0
MOVES_M, MOVES_FOR_S, MOVES_EVERY_S = 0.6, 120.0, 15.0
"""Recorded with a receiver of metres: home's height between -0.6 m and 0.6 m from where it began, for so long."""


class Unrest:
    """Accelerations that nobody asked for: a first-order Gauss-Markov process for each axis."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._accel: Vec3 = (0.0, 0.0, 0.0)

    def step(self, dt_s: float) -> Vec3:
        keep = math.exp(-dt_s / LASTS_S)
        kicks = (math.sqrt(1 - keep * keep) * self._rng.standard_normal(3)).tolist()
        n, e, u = self._accel
        self._accel = (
            keep * n + FLAT_M_S2 * kicks[0], keep * e + FLAT_M_S2 * kicks[1], keep * u + UPRIGHT_M_S2 * kicks[2],
        )  # fmt: skip
        return self._accel


class MovingHome:
    """PX4 corrects home's height after the take-off while its receiver and its barometer part."""

    def __init__(self, rng: np.random.Generator, *, is_on: bool) -> None:
        self._rng, self._is_on = rng, is_on
        self.begin()

    def begin(self) -> None:
        self.shift_m, self._next_s = 0.0, MOVES_EVERY_S

    def step(self, flown_s: float, allowed: bool) -> bool:
        """Whether it has moved."""
        if not (self._is_on and allowed) or flown_s < self._next_s or flown_s > MOVES_FOR_S:
            return False
        self._next_s += MOVES_EVERY_S
        self.shift_m = float(self._rng.uniform(-MOVES_M, MOVES_M))
        return True
