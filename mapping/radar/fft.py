"""The two Fourier transforms of a frame, along the samples of a chirp (range) and along the chirps (Doppler).

With them what their windows leave of a target beside it: which peaks are only the side lobes of stronger ones.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from mapping.errors import ParameterError
from mapping.geometry.arrays import C64, C128, F32, F64, Bools

Window = Literal["rectangular", "hann"]
"""Rectangular resolves best and has side lobes of -13 dB; Hann has -31 dB, and peaks twice as wide."""


def window(name: Window, count: int) -> F32:
    """(count,) weights whose sum is 1, so that a unit echo comes out as 1 whatever the window and the padding."""
    if name == "rectangular":
        return np.full(count, 1.0 / count, np.float32)
    if name == "hann":
        weights = np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2
        return (weights / weights.sum()).astype(np.float32)
    raise ParameterError(f"There is no window {name!r}.", where="radar", advice="Use rectangular or hann.")


def windowed(cube: NDArray[np.complexfloating], range_window: F32, doppler_window: F32) -> C64:
    """A cube (chirps, antennas, samples) with both windows applied, in one pass. What is too large becomes infinite."""
    weights = doppler_window[:, None] * range_window[None, :]
    with np.errstate(over="ignore", invalid="ignore"):
        return np.multiply(cube, weights[:, None, :], dtype=np.complex64, casting="same_kind")


def range_fft(cube: C64, size: int) -> C64:
    """(chirps, antennas, samples) -> (chirps, antennas, size) range cells, nearest first, zero padded to ``size``."""
    return np.asarray(scipy.fft.fft(cube, n=size, axis=2))


def doppler_fft(ranges: C64, size: int) -> C64:
    """(chirps, antennas, ranges) -> (size, antennas, ranges): speed 0 first, receding, then approaching from fastest.

    Positive frequencies move away (Wessendorp 2021, eq. 3).
    """
    return np.asarray(scipy.fft.fft(ranges, n=size, axis=0))


def noise_correlation(name: Window, count: int) -> C128:
    """(count // 2,) correlation of white noise between cells 0, 1, 2, ... apart, after this window.

    Zero without a window: cells of an unwindowed transform are independent. A Hann window makes neighbours alike.
    """
    power = window(name, count).astype(np.float64) ** 2
    return (np.fft.fft(power) / power.sum())[: max(1, count // 2)]


FINE = 8
"""Steps of an envelope per cell."""


def envelope(name: Window, count: int) -> F64:
    """(FINE * count / 2 + 1,) the most that a target shows so many cells (in eighths) or more away from itself."""
    response = np.abs(np.fft.fft(window(name, count).astype(np.float64), FINE * count)) ** 2
    half = response[: FINE * count // 2 + 1]
    return np.maximum.accumulate(half[::-1])[::-1]


def own_peaks(power: F64, doppler: F64, ranges: F64, across: F64, along: F64, margin: float) -> Bools:
    """(N,) Which peaks are more than ``margin`` times what the stronger ones' side lobes may show at their place.

    ``doppler`` and ``ranges`` (N,) are places in cells, both on rings; ``across`` and ``along`` their envelopes.
    Powers of side lobes are summed; twice that is what two alike come to when they meet in phase. Targets of about one
    strength, a cell or more apart, are all kept.
    """
    shown = _shown(doppler, across) * _shown(ranges, along) * power[None, :]
    stronger = power[None, :] > power[:, None]
    return power > margin * np.sum(shown, axis=1, where=stronger)


def _shown(place: F64, lobes: F64) -> F64:
    """(N, N) the envelope at the distance between every two places on the ring."""
    around = 2 * (len(lobes) - 1)
    apart = np.abs(place[:, None] - place[None, :]) * FINE
    steps = np.minimum(apart, np.abs(around - apart)).astype(np.int64)
    return lobes[np.minimum(steps, len(lobes) - 1)]
