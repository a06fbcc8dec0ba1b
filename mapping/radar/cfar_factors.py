"""How far above the mean of its neighbours a cell must be: CFAR's factors from a false-alarm probability.

Noise in neighbouring cells is alike where a window was applied. The sum of such cells' powers is distributed as that of
as many independent ones with unequal weights, the eigenvalues of their correlation; ``weights`` are these, and sum to
the number of cells. ``looks`` independent powers are summed in every cell (antennas).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import betainccinv, gammaincc, gammaln

from mapping.errors import ParameterError
from mapping.geometry.arrays import F64

Weights = tuple[float, ...]

_GRID = 1 << 15


def weights(correlation: NDArray[np.complexfloating], cells: range | list[int]) -> Weights:
    """Of cells at these places; ``correlation`` (lags,) of the complex amplitudes 0, 1, ... cells apart."""
    lags = np.subtract.outer(np.array(cells), np.array(cells))
    row = np.append(correlation, 0.0)[np.minimum(np.abs(lags), len(correlation))]
    values = np.linalg.eigvalsh(np.where(lags < 0, row.conj(), row))
    return tuple(float(x) for x in np.maximum(values, 0.0))


@lru_cache(maxsize=256)
def ca_factor(weights: Weights, false_alarm: float, looks: int = 1) -> float:
    """Factor on the mean of the training cells (cell averaging).

    With ``n`` independent cells and one look this is the well-known ``n * (false_alarm ** (-1 / n) - 1)``.
    """
    _check(weights, false_alarm, looks)
    return _solved(ca_false_alarm, weights, false_alarm, looks)


@lru_cache(maxsize=256)
def caso_factor(weights: Weights, false_alarm: float, looks: int = 1) -> float:
    """Factor on the smaller of two sides' means (smallest of; Rohling 1983); ``weights`` of one side."""
    _check(weights, false_alarm, looks)
    return _solved(caso_false_alarm, weights, false_alarm, looks)


def ca_false_alarm(weights: Weights, factor: float, looks: int = 1) -> float:
    """Probability that a noise cell exceeds ``factor`` times the mean of its training cells."""
    y, mass, _ = _sum_of_powers(weights, looks)
    return float(np.sum(mass * gammaincc(looks, factor / len(weights) * y)))


def caso_false_alarm(weights: Weights, factor: float, looks: int = 1) -> float:
    """Probability that a noise cell exceeds ``factor`` times the smaller of two sides' means.

    The smaller sum y of two has the density 2 f(y) Q(y), Q being what lies above y; the cell exceeds a y with the
    probability of a gamma variable of ``looks``.
    """
    y, mass, above = _sum_of_powers(weights, looks)
    return float(np.sum(2.0 * mass * above * gammaincc(looks, factor / len(weights) * y)))


def _solved(false_alarms: Any, weights: Weights, wanted: float, looks: int) -> float:
    """From the factor for the number of independent cells whose mean varies as much."""

    def excess(log_factor: float) -> float:
        return math.log(max(false_alarms(weights, math.exp(log_factor), looks), 1e-300) / wanted)

    worth = sum(weights) ** 2 / sum(w * w for w in weights)
    share = float(betainccinv(looks, looks * worth, wanted))
    near = math.log(worth * share / (1.0 - share))
    root: Any = brentq(excess, near - 1.0, near + 1.5, xtol=1e-10)
    return math.exp(root)


@lru_cache(maxsize=32)
def _sum_of_powers(weights: Weights, looks: int) -> tuple[F64, F64, F64]:
    """Places y, how probable a sum around each is, and how probable one above it."""
    if max(weights) - min(weights) < 1e-9:
        return _gamma(len(weights) * looks)
    return _weighted(np.array(weights), looks)


def _gamma(shape: float) -> tuple[F64, F64, F64]:
    """Over ln y, where the density is smooth and falls off on both sides, so that a plain sum is as good as exact."""
    low, high = math.log(shape) - 60.0 / shape - 3.0, math.log(shape + 12.0 * math.sqrt(shape) + 40.0)
    log_y, step = np.linspace(low, high, 2000, retstep=True)
    y = np.exp(log_y)
    mass = np.exp(shape * log_y - y - gammaln(shape)) * step
    return y, mass, gammaincc(shape, y)


def _weighted(weights: F64, looks: int) -> tuple[F64, F64, F64]:
    """Gamma variables with unequal weights: their characteristic function, transformed back."""
    mean, spread = looks * weights.sum(), math.sqrt(looks * np.sum(weights**2))
    step = (mean + 20.0 * spread + 40.0 * weights.max()) / _GRID
    frequency = 2.0 * np.pi * np.fft.rfftfreq(_GRID, step)
    characteristic = np.prod((1.0 + 1j * frequency[:, None] * weights) ** -float(looks), axis=1)
    mass = np.maximum(np.fft.irfft(characteristic, _GRID), 0.0)
    above = np.clip(1.0 - np.cumsum(mass) + 0.5 * mass, 0.0, 1.0)
    return np.arange(_GRID) * step, mass, above


def _check(weights: Weights, false_alarm: float, looks: int) -> None:
    if not (weights and looks >= 1 and 0.0 < false_alarm < 1.0):
        raise ParameterError(
            f"CFAR with {len(weights)} training cells, {looks} looks and a false-alarm probability of {false_alarm:g}.",
            where="radar",
            advice="Give at least one training cell, and a probability between 0 and 1.",
        )
