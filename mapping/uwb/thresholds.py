"""Adaptive detection thresholds: what the radar returns from ground that is known to be traversable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapping.errors import ParameterError
from mapping.geometry.arrays import F64


@dataclass(frozen=True, slots=True)
class Thresholds:
    """(bins,) each, in units of the radar's intensity."""

    detection: F64
    """T_d: the mean over the scans that were learnt from."""
    lowest: F64
    """T_min"""
    highest: F64
    """T_max, at least T_d + c_th (eq. 1)."""


class Learning:
    """Mean, least and greatest intensity of each range bin over scans of traversable ground."""

    def __init__(self, bins: int) -> None:
        self.scans = 0
        self._sum = np.zeros(bins)
        self._lowest = np.full(bins, np.inf)
        self._highest = np.full(bins, -np.inf)

    def take(self, scan: ArrayLike) -> None:
        """(bins,) A scan of which the whole field of view is traversable."""
        intensity = np.asarray(scan, np.float64)
        self._sum += intensity
        np.minimum(self._lowest, intensity, out=self._lowest)
        np.maximum(self._highest, intensity, out=self._highest)
        self.scans += 1

    def thresholds(self, least_headroom: float) -> Thresholds:
        """Raises ParameterError before the first scan."""
        if self.scans == 0:
            raise ParameterError("No scan of traversable ground has been learnt from.", where="thresholds")
        mean = self._sum / self.scans
        return Thresholds(
            mean, self._lowest.copy(), np.maximum(self._highest, mean + least_headroom)
        )  # Ahtiainen, eq. 1
