"""An FMCW radar's samples written slowly, from the length of every way; and Wessendorp 2021's eqs 1 to 3 as printed."""

from __future__ import annotations

import cmath
import math

import numpy as np

from mapping.radar.radar_params import LIGHT_M_S, FmcwParams

Place = tuple[float, float, float]
"""Right, forward, up; metres."""


def echo(
    params: FmcwParams, senders_m: list[Place], receivers_m: list[Place], place_m: Place, velocity_m_s: Place
) -> np.ndarray:
    """(chirps, senders x receivers, samples) unit echoes of a point that is at ``place_m`` in the frame's middle.

    Each sample is the phase of the ramp now, less that of the ramp that comes back now, sent so much earlier as the
    way there and back takes; the video phase that is left, pi slope delay^2, is what dechirping leaves.
    """
    cube = np.zeros((params.chirps, len(senders_m) * len(receivers_m), params.samples), np.complex128)
    middle_s = (params.chirps * params.chirp_interval_s) / 2
    for chirp in range(params.chirps):
        for s, sender in enumerate(senders_m):
            start_s = (chirp + s / len(senders_m)) * params.chirp_interval_s
            for r, receiver in enumerate(receivers_m):
                for n in range(params.samples):
                    t = n / params.sample_rate_hz
                    at = moved(place_m, velocity_m_s, start_s + t - middle_s)
                    delay_s = (math.dist(sender, at) + math.dist(at, receiver)) / LIGHT_M_S
                    cycles = params.start_frequency_hz * delay_s + params.slope_hz_per_s * delay_s * (t - delay_s / 2)
                    cube[chirp, s * len(receivers_m) + r, n] = cmath.exp(2j * math.pi * cycles)
    return cube


def moved(place_m: Place, velocity_m_s: Place, seconds: float) -> Place:
    x, y, z = (p + v * seconds for p, v in zip(place_m, velocity_m_s, strict=True))
    return x, y, z


def range_eq1(beat_hz: float, slope_hz_per_s: float) -> float:
    """eq. 1, with the slope for bandwidth over duration."""
    return LIGHT_M_S * beat_hz / (2 * slope_hz_per_s)


def bearing_eq2(phase_rad: float, wavelength_m: float, spacing_m: float) -> float:
    return math.asin(wavelength_m * phase_rad / (2 * math.pi * spacing_m))


def phase_eq3(speed_m_s: float, wavelength_m: float, interval_s: float) -> float:
    return 4 * math.pi * speed_m_s * interval_s / wavelength_m


def transform(signal: list[complex], size: int) -> list[complex]:
    """The discrete Fourier transform by its sum, zero padded to ``size``."""
    return [
        sum(x * cmath.exp(-2j * math.pi * k * n / size) for n, x in enumerate(signal)) / len(signal)
        for k in range(size)
    ]
