"""The simulated radar's numbers: TI AWR1843BOOST as in Miccinesi 2022."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.radar.radar_params import OBJECT_SPEED_CELL_M_S, OBJECT_SPEED_CELLS


@dataclass(frozen=True, slots=True)
class RadarModel:
    """Echoes fade as Swerling's first case: an exponential power around the mean, a new one at every frame.

    With noise of mean power 1 a cell is detected above T = -ln Pfa, so that a mean signal-to-noise ratio S is
    detected with probability exp(-T / (1 + S)).
    """

    range_m: float = 120.0
    """Rated: there 1 m2 straight ahead is detected with ``rated_detection``."""
    rated_detection: float = 0.8
    false_alarm: float = 1e-6
    """Of one cell: sets the threshold. How many false alarms there are is ``false_alarms``."""
    false_alarms: float = 0.5
    """Mean number per frame."""
    range_cell_m: float = 0.5
    range_sigma_m: float = 0.15
    azimuth_sigma_rad: float = math.radians(1.0)
    """Straight ahead; beside it grows as 1 / cos."""
    elevation_sigma_rad: float = math.radians(7.0)
    speed_cell_m_s: float = OBJECT_SPEED_CELL_M_S
    speed_cells: int = OBJECT_SPEED_CELLS
    """+-10.4 m/s; faster ones fold back."""
    half_width_rad: float = math.radians(60.0)
    lowest_rad: float = math.radians(-35.0)
    highest_rad: float = math.radians(25.0)
    azimuth_6db_rad: float = math.radians(50.0)
    """Off the axis where one antenna's gain is down by 6 dB, to each side."""
    elevation_6db_rad: float = math.radians(20.0)
    beams: int = 8
    """Resolved in azimuth, evenly over its sine: eight antennas half a wavelength apart."""
    side_lobe_db: float = -13.0
    side_lobe_sine: float = 0.357
    """From the main lobe to the first side lobe of eight antennas, in sines."""
    second_peak_db: float = -6.0
    """The direction search reports further peaks of a cell down to this, below the first."""
    ray_step_rad: float = math.radians(1.0)
    mount_m: float = 0.2
    """Above the vehicle's feet, in the body's frame; what it says counts from the feet."""

    @property
    def threshold(self) -> float:
        """Over the mean noise."""
        return -math.log(self.false_alarm)

    @property
    def rated_snr(self) -> float:
        """Mean signal-to-noise ratio of 1 m2 at the rated range, straight ahead."""
        return math.log(self.false_alarm) / math.log(self.rated_detection) - 1.0

    def snr(self, cross_section_m2: F64, range_m: F64, azimuth_rad: F64, elevation_rad: F64) -> F64:
        """Mean signal-to-noise ratio: the radar equation and the antennas' gain, there and back."""
        off = (azimuth_rad / self.azimuth_6db_rad) ** 2 + (elevation_rad / self.elevation_6db_rad) ** 2
        gain = 10 ** (-1.2 * off)
        return self.rated_snr * cross_section_m2 * gain * (self.range_m / range_m) ** 4

    def detection(self, snr: F64) -> F64:
        """Probability at a mean signal-to-noise ratio."""
        return np.exp(-self.threshold / (1.0 + snr))
