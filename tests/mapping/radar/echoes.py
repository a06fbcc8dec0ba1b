"""Frames of a few echoes in white noise, made quickly, for the tests of the chain."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import C64, C128
from mapping.radar.radar_params import AWR1843, LIGHT_M_S, FmcwParams

SMALL = replace(AWR1843, chirps=16, samples=64, slope_hz_per_s=4 * AWR1843.slope_hz_per_s)
"""An AWR1843 with short frames, to 32 m in cells of 0.5 m."""


@dataclass(frozen=True)
class Echo:
    range_m: float
    """In the frame's middle."""
    speed_m_s: float = 0.0
    azimuth_rad: float = 0.0
    elevation_rad: float = 0.0
    snr_db: float = 30.0
    """Of one antenna's cell, after both transforms without windows."""
    phase_rad: float = 0.0


def frame(params: FmcwParams, *echoes: Echo, seed: int | None = 1) -> C64:
    """A cube of far echoes in noise of power 1; ``seed`` None: without noise."""
    cube = np.zeros(params.shape, np.complex128) if seed is None else noise(params.shape, seed)
    for e in echoes:
        cube += _echo(params, e)
    return cube.astype(np.complex64)


def noise(shape: tuple[int, ...], seed: int) -> C128:
    rng = np.random.default_rng(seed)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / math.sqrt(2)


def _echo(p: FmcwParams, e: Echo) -> C128:
    sample_s = np.arange(p.samples) / p.sample_rate_hz
    sent_s = (np.arange(p.chirps)[:, None] - p.chirps / 2) * p.chirp_interval_s + p.offset_s[None, :]
    towards = np.array([math.cos(e.elevation_rad) * math.sin(e.azimuth_rad), math.sin(e.elevation_rad)])
    nearer_m = p.position_wavelengths @ towards * p.wavelength_m / 2
    range_m = e.range_m - nearer_m[None, :, None] + e.speed_m_s * (sent_s[:, :, None] + sample_s)
    cycles = 2 * range_m / LIGHT_M_S * (p.start_frequency_hz + p.slope_hz_per_s * sample_s)
    height = math.sqrt(10 ** (e.snr_db / 10) / (p.chirps * p.samples))
    turned = 1j * (2 * np.pi * cycles + e.phase_rad)
    return (height * np.exp(turned)).astype(np.complex128)
