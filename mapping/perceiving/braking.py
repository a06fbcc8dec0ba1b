"""How far a multirotor flies from the order to stop until it stands, and how fast it may be for what is seen."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

LEAN_M_S2 = 9.80665 * math.tan(math.radians(30.0))
"""What ArduCopter's largest lean (ANGLE_MAX, 30 degrees) decelerates by, at most."""
FASTEST_M_S = 60.0
_HALVINGS = 40


@dataclass(frozen=True, slots=True)
class Braking:
    """ArduCopter's BRAKE: a deceleration in proportion to the speed, that grows and shrinks with limited jerk.

    AP_Math's ``shape_vel_accel`` wishes for v / tau, tau = decel / jerk, at most ``decel_m_s2``. With its default
    parameters the real ArduCopter 4.7 was measured to need 4.8, 6.7, 8.8, 11.3 and 15.4 m from 3, 4, 5, 6.2 and
    8 m/s; this law says 0.1 to 0.3 m more, the creeping at the end.
    """

    decel_m_s2: float = 7.5
    """BRAKE_MODE_DECEL_RATE, a constant of ArduCopter's."""
    jerk_m_s3: float = 5.0
    """PSC_JERK_XY"""

    @property
    def tau_s(self) -> float:
        return self.decel_m_s2 / self.jerk_m_s3

    def distance_m(self, speed_m_s: float) -> float:
        """From the order to standstill, of a steady speed."""
        tau, jerk = self.tau_s, self.jerk_m_s3
        most_m_s2 = min(self.decel_m_s2, LEAN_M_S2)
        ramp_s = min(math.sqrt(tau**2 + 2 * speed_m_s / jerk) - tau, most_m_s2 / jerk)
        after_m_s = speed_m_s - jerk * ramp_s**2 / 2
        ramp_m = speed_m_s * ramp_s - jerk * ramp_s**3 / 6
        fading_m_s = min(after_m_s, most_m_s2 * tau)
        steady_m = (after_m_s**2 - fading_m_s**2) / (2 * most_m_s2)
        return ramp_m + steady_m + fading_m_s * tau


PX4_HOLD = Braking(decel_m_s2=2.6, jerk_m_s3=1.25)
"""No shorter than PX4's HOLD with its default parameters (MPC_ACC_HOR 3, MPC_JERK_AUTO 4): of the simulated PX4, which
needs 1.9, 3.8, 6.0, 8.6, 11.4, 15.1 and 21.5 m from 1 to 5, 6.2 and 8 m/s on its way, and wanders up to 0.4 m beyond,
for it does not stand still where it stops. This law says 0.4 to 4.3 m more."""
_COMPARED_M_S = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0)


def no_shorter(claimed: Braking, known: Braking) -> Braking:
    """``claimed``, unless it stops sooner than what is ``known`` at any speed."""
    is_shorter = any(claimed.distance_m(speed) < known.distance_m(speed) for speed in _COMPARED_M_S)
    return known if is_shorter else claimed


@dataclass(frozen=True, slots=True)
class Stopping:
    """From the first moment that something stands in a region until the vehicle stands before it."""

    braking: Braking
    latency_s: float
    """From being there to the vehicle's first braking: sensor, its work, a frame missed, the order's way."""
    keep_m: float
    """Left between the vehicle's middle and what was seen: hull, error of the position, half a voxel."""

    def distance_m(self, speed_m_s: float) -> float:
        return speed_m_s * self.latency_s + self.braking.distance_m(speed_m_s) + self.keep_m

    @functools.lru_cache(maxsize=128)  # noqa: B019 - equal ones are one; asked many times between two frames of a sensor
    def largest_speed_m_s(self, depth_m: float) -> float:
        """From which a region this deep is just enough to stop in; 0 where it is no deeper than what is kept."""
        low, high = 0.0, FASTEST_M_S
        if self.distance_m(low) >= depth_m:
            return 0.0
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if self.distance_m(middle) <= depth_m else (low, middle)
        return low
