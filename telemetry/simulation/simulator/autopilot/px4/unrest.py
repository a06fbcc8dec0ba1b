"""What keeps a hovering PX4 from standing still, and what moves its home in flight.

Two recorded flights tell which: the velocity that its estimator told slipped against the rate of its own position, and
it accelerated otherwise than its lean and thrust said. A replay of the recorded targets with both, as recorded, leaves
0.08 m and 0.15 m of the 0.3 m that it was beside what its controller explains, 0.06 m and 0.10 m in height. Both are
larger to the side than forward: so is the noise of its simulated gyros, twice as strong in roll as in pitch.
"""

from __future__ import annotations

import math

import numpy as np

from telemetry.simulation.simulator.neu_frame import Vec3

SLIP_M_S: Vec3 = (0.155, 0.26, 0.14)
"""How far the estimated velocity is off: forward, right, up, root mean square over 230 s of both flights."""
SLIP_RAD_S: Vec3 = (0.6, 0.6, 0.3)
SLIP_DAMPING: Vec3 = (0.5, 0.5, 0.6)
"""How it comes and goes: a damped oscillation that noise drives, as its recorded autocorrelation has it (to the side
0.84 after 1 s, 0.52 after 2 s, 0.2 after 3 s, below 0 from 4 s on)."""
PULL_PER_S: Vec3 = (0.65, 0.65, 0.33)
"""What leans the estimate moves the vehicle: by so much of the slip it accelerates the other way (regression over both
flights: 0.48 to 0.85 on the level, 0.13 to 0.87 in height)."""
SHAKE_M_S2: Vec3 = (0.12, 0.2, 0.16)
"""One sigma of the acceleration that is left, forward, right, up."""
SHAKE_LASTS_S = 0.3
MOVES_M, MOVES_FOR_S, MOVES_EVERY_S = 0.6, 120.0, 15.0
"""Recorded with a receiver of metres: home's height between -0.6 m and 0.6 m from where it began, for so long."""


class Unrest:
    """What gyro noise does to an estimate: ``slip_neu``, and accelerations of a lean that is not what it seems."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.slip_neu: Vec3 = (0.0, 0.0, 0.0)
        """Estimated less true velocity, m/s."""
        self._slip_rate: Vec3 = (0.0, 0.0, 0.0)
        self._shake: Vec3 = (0.0, 0.0, 0.0)

    def rest(self) -> None:
        """On the ground the estimator knows that it stands."""
        self.slip_neu = self._slip_rate = self._shake = (0.0, 0.0, 0.0)

    def step(self, heading_rad: float, dt_s: float) -> Vec3:
        """Accelerations, north east up."""
        kicks = self._rng.standard_normal(6).tolist()
        driven = [
            2 * sigma * math.sqrt(damping * w**3 * dt_s) * kick
            for sigma, damping, w, kick in zip(SLIP_M_S, SLIP_DAMPING, SLIP_RAD_S, kicks[:3], strict=True)
        ]
        pushes = _to_neu(driven[0], driven[1], driven[2], heading_rad)
        slips, rates = list[float](), list[float]()
        for slip, rate, push, w, damping in zip(
            self.slip_neu, self._slip_rate, pushes, SLIP_RAD_S, SLIP_DAMPING, strict=True
        ):
            rates.append(rate + push - (2 * damping * w * rate + w * w * slip) * dt_s)
            slips.append(slip + rates[-1] * dt_s)
        self.slip_neu, self._slip_rate = (slips[0], slips[1], slips[2]), (rates[0], rates[1], rates[2])
        keep = math.exp(-dt_s / SHAKE_LASTS_S)
        fresh = math.sqrt(1 - keep * keep)
        f, r, u = (
            keep * old + fresh * sigma * kick
            for old, sigma, kick in zip(self._shake, SHAKE_M_S2, kicks[3:], strict=True)
        )
        self._shake = (f, r, u)
        (n, e, up), (pull_n, pull_e, pull_u) = _to_neu(f, r, u, heading_rad), PULL_PER_S
        return n - pull_n * slips[0], e - pull_e * slips[1], up - pull_u * slips[2]


def _to_neu(forward: float, right: float, up: float, heading_rad: float) -> Vec3:
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    return forward * c - right * s, forward * s + right * c, up


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
