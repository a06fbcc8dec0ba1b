"""An FMCW radar's samples as a slow sum: every scatterer, chirp, antenna and sample by itself."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np

from mapping.radar.radar_params import FmcwParams

LIGHT_M_S = 299_792_458.0

Scatterer = tuple[float, float, float, float, complex]
"""Range, radial speed, azimuth, elevation, amplitude."""


def samples(params: FmcwParams, scatterers: Sequence[Scatterer]) -> np.ndarray:
    """(chirps, antennas, samples): exp(j (phase of the sweep now - phase of the sweep when it was sent)).

    The range goes on while chirps and samples are taken; it is given for the middle of the frame, at the middle of a
    chirp of the transmitter that sends first. Of the two phases' difference the square of the delay is left out (as
    mixers' outputs are written everywhere): 2e-7 turns.
    """
    cube = np.zeros(params.shape, complex)
    for c, k, n in np.ndindex(*params.shape):
        in_chirp_s = n / params.sample_rate_hz
        t_s = (c - (params.chirps - 1) / 2) * params.chirp_interval_s + params.offset_s[k]
        t_s += in_chirp_s - params.samples / 2 / params.sample_rate_hz
        for range_m, speed_m_s, azimuth_rad, elevation_rad, amplitude in scatterers:
            delay_s = 2 * (range_m + speed_m_s * t_s) / LIGHT_M_S
            turns = (params.start_frequency_hz + params.slope_hz_per_s * in_chirp_s) * delay_s
            right, up = params.antennas[k]
            turns -= right * math.sin(azimuth_rad) * math.cos(elevation_rad) + up * math.sin(elevation_rad)
            cube[c, k, n] += amplitude * cmath.exp(2j * math.pi * math.remainder(turns, 1.0))
    return cube
