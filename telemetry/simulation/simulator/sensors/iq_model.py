"""The simulated radars that give samples: their waveform, how they process it, where they look, how well they hear."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mapping.radar.chain import AWR1843_SETTINGS, POSITION2GO_SETTINGS, ChainSettings
from mapping.radar.fft import window
from mapping.radar.radar_params import AWR1843, POSITION2GO, FmcwParams
from telemetry.simulation.simulator.sensors.radar_model import RadarModel


@dataclass(frozen=True, slots=True)
class IqModel:
    params: FmcwParams = AWR1843
    chain: ChainSettings = AWR1843_SETTINGS
    beam: RadarModel = field(default_factory=RadarModel)
    """Field of view, gain of one antenna there and back, rays, and the strength of echoes: of 1 m2 straight ahead at
    its ``range_m`` the mean in one antenna's cell of range and speed is ``rated_snr`` over the noise. Nothing farther
    is looked at."""
    tilt_rad: float = 0.0
    """Of the boresight, up from the body's forward axis."""
    most_echoes: int = 6000
    """Of the world's echoes only so many are sampled, the strongest: it bounds the time that a frame takes."""

    @property
    def gain(self) -> float:
        """Of an echo over white noise, by both transforms and their windows, from one sample to one antenna's cell."""
        ranges = window(self.chain.range_window, self.params.samples)
        speeds = window(self.chain.doppler_window, self.params.chirps)
        return float(ranges.sum() ** 2 / (ranges**2).sum() * speeds.sum() ** 2 / (speeds**2).sum())


AWR1843_IQ = IqModel()
"""As Miccinesi 2022 flew it: the same field of view and strength as the simulated radar without samples."""

POSITION2GO_IQ = IqModel(
    params=POSITION2GO,
    chain=POSITION2GO_SETTINGS,
    beam=RadarModel(
        range_m=24.0,
        rated_detection=0.5,
        range_cell_m=0.75,
        half_width_rad=math.radians(65.0),
        lowest_rad=math.radians(-35.0),
        highest_rad=math.radians(35.0),
        azimuth_6db_rad=math.radians(38.0),
        elevation_6db_rad=math.radians(9.5),
    ),
    tilt_rad=math.radians(10.0),
)
"""As Wessendorp 2021 flew it: 76 x 19 degrees between half powers, a person from 1 to 12 m, mounted 10 degrees up."""
