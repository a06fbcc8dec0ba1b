"""Global nearest neighbours as printed (Wessendorp 2021, eqs 4-6): the whole matrix, and every assignment tried."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from mapping.geometry.arrays import F64


def matrix(distances: F64, *, gate: float, detection_probability: float) -> F64:
    """(n, m + n) [ -l(i,j) | -l(i,0) on the diagonal, infinite elsewhere ]."""
    n, m = distances.shape
    out = np.full((n, m + n), math.inf)
    for i in range(n):
        for j in range(m):
            if distances[i, j] < gate:
                out[i, j] = 0.5 * distances[i, j]  # eq. 6
        out[i, m + i] = -math.log(1.0 - detection_probability)  # eq. 5
    return out


def cost(printed: F64, columns: Sequence[int]) -> float:
    return sum(float(printed[i, j]) for i, j in enumerate(columns))


def cheapest(printed: F64) -> float:
    """Of all ways to give each row a column of its own."""
    rows, columns = printed.shape
    return min(cost(printed, chosen) for chosen in itertools.permutations(range(columns), rows))
