"""How wrong the simulated vehicle's own idea of its attitude is: a compass off by a little, a level off by less."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from telemetry.simulator.frame import Vec3

HEADING_BIAS_RAD = math.radians(0.5)
"""At most, to either side; constant for a flight."""
LEVEL_SIGMA_RAD = math.radians(0.2)


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
