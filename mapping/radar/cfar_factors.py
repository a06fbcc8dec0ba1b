"""How far above the mean of its neighbours a cell must be: CFAR's factors from a false-alarm probability."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import betainccinv, gammaincc, gammaln

from mapping.errors import ParameterError


@lru_cache(maxsize=256)
def ca_factor(cells: float, false_alarm: float, looks: int = 1) -> float:
    """Factor on the mean of ``cells`` training cells (cell averaging).

    ``looks`` independent powers are summed in every cell (antennas). The ratio of two gamma variables is a beta
    prime's; with one look this is the well-known ``cells * (false_alarm ** (-1 / cells) - 1)``. ``cells`` may be
    fractional: as many independent cells as correlated ones are worth.
    """
    _check(cells, false_alarm, looks)
    share = float(betainccinv(looks, looks * cells, false_alarm))
    return cells * share / (1.0 - share)


@lru_cache(maxsize=256)
def caso_factor(cells: float, false_alarm: float, looks: int = 1) -> float:
    """Factor on the smaller of two means of ``cells`` training cells each (smallest of; Rohling 1983)."""
    _check(cells, false_alarm, looks)

    def excess(log_factor: float) -> float:
        return math.log(caso_false_alarm(cells, math.exp(log_factor), looks) / false_alarm)

    one_side = math.log(ca_factor(cells, false_alarm, looks))  # at least this, and at most about twice as much
    root: Any = brentq(excess, one_side - 0.01, one_side + 1.0, xtol=1e-10)
    return math.exp(root)


def caso_false_alarm(cells: float, factor: float, looks: int = 1) -> float:
    """Probability that a noise cell exceeds ``factor`` times the smaller mean of two sides of ``cells`` cells.

    The smaller sum y of two gamma variables has the density 2 f(y) Q(y), Q being what lies above y; the cell exceeds
    a y with the probability of a gamma variable of ``looks``. Summed over ln y, where the integrand is smooth and
    falls off on both sides, so that the plain sum is as good as exact.
    """
    shape = cells * looks
    low, high = math.log(shape) - 60.0 / shape - 3.0, math.log(shape + 12.0 * math.sqrt(shape) + 40.0)
    log_y, step = np.linspace(low, high, 2000, retstep=True)
    y = np.exp(log_y)
    density = np.exp(shape * log_y - y - gammaln(shape))  # f(y) dy = density d(ln y)
    above = gammaincc(looks, factor / cells * y)
    return float(np.sum(2.0 * density * gammaincc(shape, y) * above) * step)


def ca_detection(cells: float, factor: float, snr: float) -> float:
    """Probability that CA-CFAR sees a fluctuating target (Swerling 1) of mean ``snr`` (a ratio), with one look."""
    return (1.0 + factor / (cells * (1.0 + snr))) ** -cells


def worth(correlation: np.ndarray, cells: int) -> float:
    """How many independent cells the mean of ``cells`` neighbours is worth, given their squared correlation by lag."""
    lags = np.arange(1, cells)
    return cells / (1.0 + 2.0 * float(np.sum((1.0 - lags / cells) * correlation[: cells - 1])))


def _check(cells: float, false_alarm: float, looks: int) -> None:
    if not (cells > 0 and looks >= 1 and 0.0 < false_alarm < 1.0):
        raise ParameterError(
            f"CFAR with {cells:g} training cells, {looks} looks and a false-alarm probability of {false_alarm:g}.",
            where="radar",
            advice="Give at least one training cell, and a probability between 0 and 1.",
        )
