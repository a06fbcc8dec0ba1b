"""Keeps the simulated vehicle on its target: position to velocity to acceleration, with a memory for the wind."""

from __future__ import annotations

import math

from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2
from telemetry.simulation.simulator.neu_frame import Vec3

POSITION_PER_S = 1.0
VELOCITY_PER_S = 2.0
VELOCITY_MEMORY_PER_S2 = 1.0
MEMORY_M_S2 = 5.0
HEIGHT_PER_S = 1.0
CLIMB_PER_S = 5.0
CLIMB_MEMORY_PER_S2 = 1.0
FASTEST_CORRECTION_M_S = 3.0


class PositionControl:
    """ArduCopter's cascade with its default gains (PSC_POSXY_P 1, PSC_VELXY_P 2, PSC_VELXY_I 1, PSC_VELZ_P 5)."""

    def __init__(self) -> None:
        self._memory: Vec3 = (0.0, 0.0, 0.0)

    def reset(self) -> None:
        self._memory = (0.0, 0.0, 0.0)

    def demand(
        self, target: tuple[Vec3, Vec3, Vec3], p_neu: Vec3, v_neu: Vec3, max_tilt_rad: float, dt_s: float
    ) -> Vec3:
        """Acceleration to ask of the airframe, from the target's motion and the estimated one."""
        (pt, vt, at), (mn, me, mu) = target, self._memory
        cn, ce = _limited(
            POSITION_PER_S * (pt[0] - p_neu[0]), POSITION_PER_S * (pt[1] - p_neu[1]), FASTEST_CORRECTION_M_S
        )
        en, ee = vt[0] + cn - v_neu[0], vt[1] + ce - v_neu[1]
        eu = vt[2] + max(-1.5, min(1.5, HEIGHT_PER_S * (pt[2] - p_neu[2]))) - v_neu[2]
        mn, me = _limited(mn + VELOCITY_MEMORY_PER_S2 * en * dt_s, me + VELOCITY_MEMORY_PER_S2 * ee * dt_s, MEMORY_M_S2)
        mu = max(-MEMORY_M_S2, min(MEMORY_M_S2, mu + CLIMB_MEMORY_PER_S2 * eu * dt_s))
        self._memory = (mn, me, mu)
        most = GRAVITY_M_S2 * math.tan(max_tilt_rad)
        north, east = _limited(at[0] + VELOCITY_PER_S * en + mn, at[1] + VELOCITY_PER_S * ee + me, most)
        return north, east, at[2] + CLIMB_PER_S * eu + mu


def _limited(x: float, y: float, most: float) -> tuple[float, float]:
    size = math.hypot(x, y)
    return (x, y) if size <= most else (x * most / size, y * most / size)
