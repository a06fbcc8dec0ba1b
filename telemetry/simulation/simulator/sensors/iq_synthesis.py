"""From echoes to what an FMCW radar's converters sample: cubes of complex samples per chirp, antenna and time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from scipy.fft import ifft
from scipy.special import i0

from mapping.geometry.arrays import C64, C128, F32, F64
from mapping.radar.radar_params import LIGHT_M_S, FmcwParams

_TAPS, _OVERSAMPLING = 6, 2
_BETA = 2.34 * _TAPS
_TABLE_STEPS = 2048
"""Per tap; between them the gridding kernel is taken as a line."""


@dataclass(frozen=True, slots=True)
class Returns:
    """Point scatterers in the radar's own coordinates, at the middle of the frame."""

    range_m: F64
    radial_speed_m_s: F64
    """Positive: moving away."""
    azimuth_rad: F64
    """Clockwise from the boresight."""
    elevation_rad: F64
    amplitude: C128
    """(N,) of each sample, where the noise of one sample has variance 1"""


def strongest(returns: Returns, count: int) -> Returns:
    """At most ``count`` of them, those of the largest amplitude."""
    if len(returns.range_m) <= count:
        return returns
    kept = np.argpartition(-np.abs(returns.amplitude), count - 1)[:count]
    return Returns(
        returns.range_m[kept],
        returns.radial_speed_m_s[kept],
        returns.azimuth_rad[kept],
        returns.elevation_rad[kept],
        returns.amplitude[kept],
    )


def sampled(params: FmcwParams, returns: Returns) -> C64:
    """(chirps, virtual antennas, samples) without noise, transmitters already told apart.

    Each scatterer's beat is exp(j 2 pi (f0 tau + S tau t)), tau = 2 r / c (Wessendorp 2021, eq. 1), r of the moment:
    it moves while a chirp lasts (which shifts the beat by the Doppler frequency), from chirp to chirp (phase, eq. 3,
    and range) and from one transmitter's turn to the next's. An antenna to the right is nearer to what is on the right.

    Beats have any frequency: each is spread with a Kaiser-Bessel kernel over six bins of a spectrum of twice the
    samples, one inverse FFT per chirp and antenna sums them, and the kernel's own transform is divided out. That is
    within 1e-4 of the exact sum for what stands still, and within 1e-2 at 10 m/s, where the range that is flown
    within a chirp changes the beat a little; an echo costs as much as 6 samples instead of all.
    """
    beat, drift = _beats(params, returns)
    bins = params.samples * _OVERSAMPLING
    # What lies beyond the unambiguous range is kept off the converters by the filter before them.
    kept = np.flatnonzero((beat >= 0.0) & (beat < 1.0))
    kept = kept[np.argsort(beat[kept])]
    turns = _antenna_turns(params, returns)[kept]
    # Wessendorp 2021, eq. 3
    per_chirp = 2 * returns.radial_speed_m_s[kept] / params.wavelength_m * params.chirp_interval_s
    # Time counts from the middle of a chirp, and of the frame.
    start = returns.amplitude[kept] * np.exp(
        2j * np.pi * np.remainder(2 * returns.range_m[kept] / params.wavelength_m, 1.0)
    )
    grid = np.zeros((bins, params.chirps, 2 * len(params.antennas)), np.float32)
    _spread(grid, beat[kept] * bins, drift[kept] * bins, start, per_chirp, turns, _table())
    cube = np.asarray(ifft(grid.view(np.complex64), axis=0, norm="forward", overwrite_x=True))
    half = params.samples // 2
    cube = np.concatenate([cube[bins - half :], cube[: params.samples - half]])
    cube *= _correction(params.samples)[:, None, None]
    return np.ascontiguousarray(cube.transpose(1, 2, 0))


def _beats(params: FmcwParams, returns: Returns) -> tuple[F64, F64]:
    """(N,) beat in turns per sample, and by how much it grows per chirp because the scatterer moves."""
    per_metre = 2 * params.slope_hz_per_s / LIGHT_M_S / params.sample_rate_hz  # Wessendorp 2021, eq. 1
    doppler = 2 * returns.radial_speed_m_s / params.wavelength_m / params.sample_rate_hz
    return (
        per_metre * returns.range_m + doppler,
        per_metre * returns.radial_speed_m_s * params.chirp_interval_s,
    )


def _antenna_turns(params: FmcwParams, returns: Returns) -> F64:
    """(N, antennas) phase in turns: where each stands, and how long its transmitter's turn comes after the first's."""
    right = np.sin(returns.azimuth_rad) * np.cos(returns.elevation_rad)
    nearer = np.column_stack([right, np.sin(returns.elevation_rad)]) @ params.position_wavelengths.T
    doppler_hz = 2 * returns.radial_speed_m_s / params.wavelength_m
    return doppler_hz[:, None] * params.offset_s[None, :] - nearer


@lru_cache(maxsize=1)
def _table() -> F32:
    """The kernel over -taps/2 .. taps/2, in steps, with one more for interpolation."""
    x = np.linspace(-1.0, 1.0, _TAPS * _TABLE_STEPS + 1)
    return np.append(i0(_BETA * np.sqrt(np.maximum(0.0, 1.0 - x * x))) / i0(_BETA), 0.0).astype(np.float32)


@lru_cache(maxsize=8)
def _correction(samples: int) -> F32:
    """(samples,) one over the kernel's transform at each sample's time."""
    n = np.arange(samples) - samples // 2
    root = np.sqrt(_BETA**2 - (math.pi * _TAPS * n / (samples * _OVERSAMPLING)) ** 2)
    return (i0(_BETA) * root / (_TAPS * np.sinh(root))).astype(np.float32)


@njit(cache=True, nogil=True, fastmath=True)
def _spread(grid, place, drift, start, per_chirp, turns, table):
    """Adds every scatterer's phasors to the bins around its beat. ``grid`` is (bins, chirps, re and im per antenna)."""
    bins, chirps, width = grid.shape
    antenna, phasor = np.empty(width, np.float32), np.empty((chirps, width), np.float32)
    for e in range(place.shape[0]):
        for k in range(width // 2):
            value = start[e] * np.exp(2j * math.pi * turns[e, k])
            antenna[2 * k], antenna[2 * k + 1] = value.real, value.imag
        turn = np.exp(-1j * math.pi * (chirps - 1) * per_chirp[e])
        further = np.exp(2j * math.pi * per_chirp[e])
        for c in range(chirps):
            cos, sin = np.float32(turn.real), np.float32(turn.imag)
            turn *= further
            for k in range(width // 2):
                phasor[c, 2 * k] = antenna[2 * k] * cos - antenna[2 * k + 1] * sin
                phasor[c, 2 * k + 1] = antenna[2 * k] * sin + antenna[2 * k + 1] * cos
        for c in range(chirps):
            where = place[e] + (c - 0.5 * (chirps - 1)) * drift[e]
            first = math.ceil(where - 0.5 * _TAPS)
            at = (first - where + 0.5 * _TAPS) * _TABLE_STEPS
            step = int(at)
            part = np.float32(at - step)
            for tap in range(_TAPS):
                weight = table[step] + part * (table[step + 1] - table[step])
                b = (first + tap) % bins
                for i in range(width):
                    grid[b, c, i] += weight * phasor[c, i]
                step += _TABLE_STEPS
