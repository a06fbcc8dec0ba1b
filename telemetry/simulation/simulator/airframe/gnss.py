"""How wrong the simulated vehicle's position estimate is, and what its receiver says about itself."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from telemetry.simulation.simulator.neu_frame import Vec3

GnssKind = Literal["standalone", "rtk", "perfect"]
CEP_PER_SIGMA = math.sqrt(2 * math.log(2))
"""Median of the distance from two normal errors of sigma 1."""
DRAWS = 18
"""Errors drawn per correlation time: a standalone receiver's is a new one every 10 s."""


@dataclass(frozen=True, slots=True)
class GnssReceiver:
    """One sigma per axis, and how long an error lasts."""

    horizontal_m: float
    vertical_m: float
    correlation_s: float
    fix: Literal["3d", "rtk_fixed"]
    satellites: int
    hdop: float
    h_acc_m: float
    v_acc_m: float


RECEIVERS: dict[GnssKind, GnssReceiver] = {
    # The vertical error is that of the fused height (a barometer holds it between fixes), not of GNSS alone.
    "standalone": GnssReceiver(2.5 / CEP_PER_SIGMA, 0.8, 180.0, "3d", 14, 0.85, 2.5, 3.5),
    "rtk": GnssReceiver(0.05 / math.sqrt(2), 0.05, 60.0, "rtk_fixed", 24, 0.6, 0.05, 0.05),
    "perfect": GnssReceiver(0.0, 0.0, 60.0, "rtk_fixed", 10, 1.21, 0.3, 0.3),
}


class Gnss:
    """Errors drift: each axis is a first-order Gauss-Markov process, started in its steady state within two sigma."""

    def __init__(self, kind: GnssKind, rng: np.random.Generator) -> None:
        self.receiver = RECEIVERS[kind]
        self._rng = rng
        self._sigma = (self.receiver.horizontal_m, self.receiver.horizontal_m, self.receiver.vertical_m)
        kicks = np.clip(rng.standard_normal(3), -2, 2).tolist()
        self.error_neu: Vec3 = (kicks[0] * self._sigma[0], kicks[1] * self._sigma[1], kicks[2] * self._sigma[2])
        """Estimate minus truth, m"""
        self.error_rate_neu: Vec3 = (0.0, 0.0, 0.0)
        self._towards = self.error_neu
        self._left_s = 0.0

    def step(self, dt_s: float) -> None:
        """A new error now and then, reached in a straight line: an estimator lets no step through."""
        if self.receiver.horizontal_m == 0:
            return
        if self._left_s <= 0:
            self._draw()
        n, e, u = self.error_neu
        rn, re, ru = self.error_rate_neu
        self.error_neu = (n + rn * dt_s, e + re * dt_s, u + ru * dt_s)
        self._left_s -= dt_s

    def _draw(self) -> None:
        wait_s = self.receiver.correlation_s / DRAWS
        keep = math.exp(-1.0 / DRAWS)
        spread = math.sqrt(1 - keep * keep)
        kicks = self._rng.standard_normal(3).tolist()
        target = [
            keep * old + spread * sigma * kick
            for old, sigma, kick in zip(self._towards, self._sigma, kicks, strict=True)
        ]
        self._towards = (target[0], target[1], target[2])
        n, e, u = self.error_neu
        self.error_rate_neu = ((target[0] - n) / wait_s, (target[1] - e) / wait_s, (target[2] - u) / wait_s)
        self._left_s = wait_s
