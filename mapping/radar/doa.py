"""Direction of arrival: azimuth by FFT over the row of antennas, or by phase difference where there are but two.

The elevation, from the phase between two rows half a wavelength apart, is rough: it serves as a gate only
(Miccinesi 2022, section 2.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from mapping.errors import ParameterError
from mapping.geometry.arrays import C64, F64, I64
from mapping.radar.radar_params import FmcwParams


@dataclass(frozen=True, slots=True)
class Rows:
    """A virtual array taken apart into the row that measures azimuth and, if there is one, another for elevation."""

    row: I64
    """(n,) antennas of the longest row"""
    right: F64
    """(n,) where they are, wavelengths"""
    slots: I64
    """(n,) the same in whole spacings, from 0"""
    spacing: float
    """Wavelengths; infinite with one antenna."""
    other: I64
    """(m,) antennas of the other row; empty without"""
    other_right: F64
    lift: float
    """How much higher than the first the other row is, wavelengths."""


def rows_of(params: FmcwParams) -> Rows:
    """Raises ParameterError for antennas that do not stand on a grid of equal spacings."""
    right, up = params.position_wavelengths.T
    heights, counts = np.unique(up.round(6), return_counts=True)
    order = np.argsort(-counts, kind="stable")
    row = np.flatnonzero(up.round(6) == heights[order[0]])
    row = row[np.argsort(right[row], kind="stable")]
    other = np.flatnonzero(up.round(6) == heights[order[1]]) if len(heights) > 1 else np.empty(0, np.int64)
    lift = float(heights[order[1]] - heights[order[0]]) if len(heights) > 1 else 0.0
    slots, spacing = _on_grid(right[row])
    return Rows(row, right[row], slots, spacing, other, right[other], lift)


def _on_grid(right: F64) -> tuple[I64, float]:
    if len(right) == 1:
        return np.zeros(1, np.int64), np.inf
    spacing = float(np.diff(right).min())
    slots = (right - right[0]) / spacing if spacing > 0 else np.full(len(right), np.nan)
    if not (spacing > 0 and np.allclose(slots, slots.round(), atol=0.01)):
        raise ParameterError(
            f"Antennas at {', '.join(f'{x:g}' for x in right)} wavelengths do not stand on one grid.",
            where="radar",
            advice="Give positions that are whole multiples of one spacing, each once.",
        )
    return slots.round().astype(np.int64), spacing


def without_doppler(snapshots: C64, cycles_per_s: F64, params: FmcwParams) -> C64:
    """(N, antennas) with what the target moved while the transmitters took turns taken out of the phases.

    ``cycles_per_s`` (N,) is the measured Doppler frequency. A speed that is wrong by the ambiguity leaves a step of
    a whole turn divided by the number of transmitters between their antennas, and so a false direction.
    """
    if params.turns == 1:
        return snapshots
    turned = np.exp(-2j * np.pi * cycles_per_s[:, None] * params.offset_s[None, :])
    return (snapshots * turned).astype(np.complex64)


def azimuth_axis(rows: Rows, size: int) -> F64:
    """(size,) sine of the angle to the right of each cell of ``azimuth_spectrum``, ascending."""
    return np.fft.fftshift(np.fft.fftfreq(size)).astype(np.float64) / rows.spacing


def azimuth_spectrum(snapshots: C64, rows: Rows, size: int) -> F64:
    """(N, antennas) -> (N, size) power by direction: the FFT over the row, zero padded.

    The nearer antenna's phase lags, so the conjugate's frequency grows to the right.
    """
    line = np.zeros((len(snapshots), int(rows.slots[-1]) + 1), np.complex64)
    line[:, rows.slots] = snapshots[:, rows.row].conj()
    spectrum: C64 = np.fft.fftshift(np.asarray(scipy.fft.fft(line, n=size, axis=1)), axes=1)
    return (spectrum.real**2 + spectrum.imag**2).astype(np.float64)


def directions(spectrum: F64, rows: Rows, second: float, least: F64) -> tuple[I64, F64]:
    """(N, size) -> (M,) which snapshot, (M,) sine to the right: each one's highest peak, and others at least
    ``second`` times as high and above ``least`` (N,). Between cells by the parabola through the logarithms.
    """
    before, after = np.roll(spectrum, 1, axis=1), np.roll(spectrum, -1, axis=1)
    top = spectrum.max(axis=1)
    high = spectrum >= np.minimum(top, np.maximum(second * top, least))[:, None]
    which, cell = np.nonzero(high & (spectrum > before) & (spectrum >= after))
    size = spectrum.shape[1]
    low, here, up = (np.log(np.maximum(s[which, cell], 1e-30)) for s in (before, spectrum, after))
    shift = vertex(low, here, up)
    return which, (cell + shift - size // 2) / size / rows.spacing


def vertex(low: F64, here: F64, up: F64) -> F64:
    """Where between -0.5 and 0.5 the parabola through three values has its top, the middle one being the highest."""
    bend = low - 2.0 * here + up
    top = 0.5 * (low - up) / np.where(bend < 0.0, bend, -1.0)
    return np.where(bend < 0.0, np.minimum(np.maximum(top, -0.5), 0.5), 0.0)


def phase_direction(snapshots: C64, rows: Rows) -> F64:
    """(N, antennas) -> (N,) sine to the right, from the phase between the row's first two antennas.

    Wessendorp 2021, eq. 2: ``theta = asin(wavelength dphi / (2 pi d))``; the nearer antenna lags.
    """
    first, second = snapshots[:, rows.row[0]], snapshots[:, rows.row[1]]
    lag: F64 = np.angle(first * second.conj()).astype(np.float64)
    return lag / (2 * np.pi * rows.spacing)  # Wessendorp 2021, eq. 2


def elevation_sine(snapshots: C64, sine_right: F64, rows: Rows) -> F64:
    """(N, antennas) and (N,) sine to the right -> (N,) sine upwards, from the phase between the two rows.

    Both rows are first pointed at the target; zero where there is one row.
    """
    if not len(rows.other):
        return np.zeros(len(sine_right))
    here = _pointed(snapshots[:, rows.row], rows.right, sine_right)
    there = _pointed(snapshots[:, rows.other], rows.other_right, sine_right)
    return np.clip(np.angle(here * there.conj()) / (2 * np.pi * rows.lift), -1.0, 1.0)


def _pointed(antennas: C64, right: F64, sine_right: F64) -> NDArray[np.complexfloating]:
    return np.sum(antennas * np.exp(2j * np.pi * sine_right[:, None] * right[None, :]), axis=1)
