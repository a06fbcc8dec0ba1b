"""CFAR detection: CASO along range, CA along Doppler; and both at once where the map has its peaks.

Miccinesi 2022, fig. 7. The smallest-of rule along range keeps a target beside clutter; plain averaging along Doppler
keeps what has a well-defined speed. Both axes are rings, as the transforms make them: the cells before the first are
the last. In range that gives near targets two sides, as any other has, and what stands behind them does not hide them.
A side that would reach the cells around range zero, where the transmitter is heard directly, is taken from beyond them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.errors import ParameterError
from mapping.geometry.arrays import F32, I64
from mapping.radar.cfar_factors import ca_factor, caso_factor, weights
from mapping.radar.fft import Window, noise_correlation


@dataclass(frozen=True, slots=True)
class Cfar:
    """One stage's cells, in resolution cells (zero padding does not count), and its false-alarm probability."""

    guard: int
    """On each side of the tested cell, left out."""
    training: int
    """On each side beyond the guard, averaged."""
    false_alarm: float = 1e-4


@dataclass(frozen=True, slots=True)
class Stage:
    """A stage made ready for a map: its steps and its factor on the neighbours' mean."""

    guard: int
    training: int
    stride: int
    """Cells of the map per resolution cell: only every so many are independent."""
    factor: float


def range_stage(cfar: Cfar, *, name: Window, samples: int, padding: int, looks: int) -> Stage:
    """CASO for a map whose range axis has ``samples * padding`` cells, ``looks`` antennas summed in each."""
    _check(cfar, samples, 4 * cfar.guard + 3 * cfar.training + 1, "range")
    side = weights(noise_correlation(name, samples), range(cfar.training))
    return Stage(cfar.guard, cfar.training, padding, caso_factor(side, cfar.false_alarm, looks))


def doppler_stage(cfar: Cfar, *, name: Window, chirps: int, padding: int, looks: int) -> Stage:
    """CA for a map whose Doppler axis has ``chirps * padding`` cells."""
    _check(cfar, chirps, 2 * (cfar.guard + cfar.training) + 1, "Doppler")
    side = range(cfar.guard + 1, cfar.guard + cfar.training + 1)
    both = weights(noise_correlation(name, chirps), [*(-k for k in side), *side])
    return Stage(cfar.guard, cfar.training, padding, ca_factor(both, cfar.false_alarm, looks))


def peaks(power: F32, along_range: Stage, along_doppler: Stage, first: int, last: int) -> tuple[I64, F32]:
    """(Doppler, range) -> (N, 2) cells that are the highest of their 3 x 3 and exceed both thresholds, (N,) the noise.

    Only range cells first..last - 1 are tested. The noise is the mean that the stage along range compared with.
    Testing the thresholds at peaks alone comes to the same as both maps and peaks among them, at a twentieth the work.
    """
    most = power.size // 2 + 1  # a peak's neighbours are none
    cells, noise = np.empty((most, 2), np.int64), np.empty(most, np.float32)
    found = _peaks(power, *stage_numbers(along_range), *stage_numbers(along_doppler), first, last, cells, noise)
    return cells[:found], noise[:found]


def stage_numbers(stage: Stage) -> tuple[int, int, int, float]:
    return stage.guard, stage.training, stage.stride, stage.factor


@njit(cache=True, nogil=True)
def caso_mean(row, c, guard, training, stride):
    """The smaller mean of the cells on either side in range, around the ring and past the direct coupling."""
    size, near, far, coupling = row.shape[0], (guard + 1) * stride, (guard + training) * stride, guard * stride
    left = c - near if c - far > coupling else -near
    right = c + near if c + far < size - coupling else near
    nearer = farther = np.float32(0.0)
    for k in range(0, training * stride, stride):
        nearer += row[(left - k) % size]
        farther += row[(right + k) % size]
    return min(nearer, farther) / training


@njit(cache=True, nogil=True)
def ca_mean(power, d, c, guard, training, stride):
    """The mean of the cells on both sides in speed, around the ring."""
    size = power.shape[0]
    total = np.float32(0.0)
    for k in range(guard + 1, guard + training + 1):
        total += power[(d - k * stride) % size, c] + power[(d + k * stride) % size, c]
    return total / (2 * training)


@njit(cache=True, nogil=True)
def _highest(power, d, c):
    """Of its 3 x 3; of equal neighbours the first counts."""
    size, here = power.shape[0], power[d, c]
    for k in (-1, 0, 1):
        row = power[(d + k) % size]
        for j in (-1, 0, 1):
            if not 0 <= c + j < row.shape[0] or (k == 0 and j == 0) or (k != 0 and size == 1):
                continue
            before = k < 0 or (k == 0 and j < 0)
            if row[c + j] > here or (before and row[c + j] == here):
                return False
    return True


@njit(cache=True, nogil=True)
def _peaks(power, guard, training, stride, factor, d_guard, d_training, d_stride, d_factor, first, last, cells, noise):
    found = 0
    for d in range(power.shape[0]):
        row = power[d]
        for c in range(first, last):
            here = row[c]
            if (c > 0 and row[c - 1] >= here) or (c + 1 < row.shape[0] and row[c + 1] > here):
                continue
            if not _highest(power, d, c):
                continue
            beside = caso_mean(row, c, guard, training, stride)
            if here > factor * beside and here > d_factor * ca_mean(power, d, c, d_guard, d_training, d_stride):
                cells[found, 0], cells[found, 1], noise[found] = d, c, beside
                found += 1
    return found


def _check(cfar: Cfar, cells: int, least: int, axis: str) -> None:
    """``least``: on a ring as small no cell is its own neighbour, nor on both sides of another."""
    if cfar.guard < 0 or cfar.training < 1 or cells < least:
        raise ParameterError(
            f"CFAR along {axis} needs {least} cells ({cfar.guard} guard, {cfar.training} training); there are {cells}.",
            where="radar",
            advice="Take fewer guard or training cells, or longer frames.",
        )
