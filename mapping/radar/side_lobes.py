"""Which peaks are only the side lobes of stronger ones."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.radar.fft import Window, window

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
