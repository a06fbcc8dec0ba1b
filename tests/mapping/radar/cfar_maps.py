"""The stages over whole maps, where the product tests its peaks alone."""

from __future__ import annotations

import numpy as np
from numba import njit

from mapping.geometry.arrays import F32, Bools
from mapping.radar.cfar import Stage, ca_mean, caso_mean, stage_numbers


def caso_along_range(power: F32, stage: Stage) -> Bools:
    """(Doppler, range) -> which cells exceed the threshold that their neighbours in range set."""
    above = np.empty(power.shape, np.bool_)
    _caso_all(np.ascontiguousarray(power, np.float32), *stage_numbers(stage), above)
    return above


def ca_along_doppler(power: F32, stage: Stage) -> Bools:
    """(Doppler, range) -> which cells exceed the threshold that their neighbours in speed set."""
    above = np.empty(power.shape, np.bool_)
    _ca_all(np.ascontiguousarray(power, np.float32), *stage_numbers(stage), above)
    return above


@njit(cache=True, nogil=True)
def _caso_all(power, guard, training, stride, factor, above):
    for d in range(power.shape[0]):
        for c in range(power.shape[1]):
            above[d, c] = power[d, c] > factor * caso_mean(power[d], c, guard, training, stride)


@njit(cache=True, nogil=True)
def _ca_all(power, guard, training, stride, factor, above):
    for d in range(power.shape[0]):
        for c in range(power.shape[1]):
            above[d, c] = power[d, c] > factor * ca_mean(power, d, c, guard, training, stride)
