"""PX4's position controller: a place gives a velocity, a velocity an acceleration, with a memory for drag and wind."""

from __future__ import annotations

import math

from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.leg_curves import Motion
from telemetry.simulation.simulator.autopilot.shaping import limited
from telemetry.simulation.simulator.neu_frame import Vec3

MEMORY_M_S2 = GRAVITY_M_S2
FASTER_DOWN_M_S = 0.5
"""Than MPC_Z_VEL_MAX_DN: what was recorded in correcting a height."""
LARGEST_THRUST_M_S2 = 20.0


class Px4PositionControl:
    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._memory: Vec3 = (0.0, 0.0, 0.0)
        self._velocity: Vec3 | None = None

    def reset(self) -> None:
        self._memory, self._velocity = (0.0, 0.0, 0.0), None

    def demand(
        self, target: Motion, p_neu: Vec3, v_neu: Vec3, dt_s: float, *, climb_m_s: float, tilt_rad: float
    ) -> Vec3:
        """Acceleration to ask of the airframe; ``climb_m_s``: how fast it may rise now, below 0 on the ground."""
        p, (pt, vt, at) = self._parameters, target
        was = self._velocity or v_neu
        change = tuple((now - then) / dt_s for now, then in zip(v_neu, was, strict=True))
        self._velocity = v_neu
        north, east = limited(
            vt[0] + p["MPC_XY_P"] * (pt[0] - p_neu[0]),
            vt[1] + p["MPC_XY_P"] * (pt[1] - p_neu[1]),
            p["MPC_XY_VEL_MAX"],
        )
        up = vt[2] + p["MPC_Z_P"] * (pt[2] - p_neu[2])
        up = max(-p["MPC_Z_VEL_MAX_DN"] - FASTER_DOWN_M_S, min(climb_m_s, up))
        en, ee, eu = north - v_neu[0], east - v_neu[1], up - v_neu[2]
        mn, me, mu = self._memory
        gain, damping = p["MPC_XY_VEL_P_ACC"], p["MPC_XY_VEL_D_ACC"]
        an = at[0] + gain * en + mn - damping * change[0]
        ae = at[1] + gain * ee + me - damping * change[1]
        au = at[2] + p["MPC_Z_VEL_P_ACC"] * eu + mu
        most = (GRAVITY_M_S2 + max(-GRAVITY_M_S2 / 2, au)) * math.tan(tilt_rad)
        ln, le = limited(an, ae, most)
        if (ln, le) == (an, ae):  # a memory that can do nothing grows no more
            mn, me = mn + p["MPC_XY_VEL_I_ACC"] * en * dt_s, me + p["MPC_XY_VEL_I_ACC"] * ee * dt_s
        if -GRAVITY_M_S2 < au < LARGEST_THRUST_M_S2 - GRAVITY_M_S2:
            mu = max(-MEMORY_M_S2, min(MEMORY_M_S2, mu + p["MPC_Z_VEL_I_ACC"] * eu * dt_s))
        self._memory = (mn, me, mu)
        return ln, le, au
