"""Which detection belongs to which object: the cheapest of all assignments (Wessendorp 2021, eqs 4-6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

F64 = NDArray[np.float64]
Indices = NDArray[np.int64]


def assign(distances: F64, *, gate: float, miss_cost: float) -> tuple[Indices, Indices]:
    """Squared distances (N objects, M detections) -> which objects, and each one's detection; the rest go without.

    Eq. 4 puts beside the costs a square one with the price of a miss on its diagonal. An object and a detection that
    cost more than the miss are never matched; so costs less that price, no more than 0, have the same answer in the
    N x M matrix alone: a pair that comes to 0 is a miss.
    """
    likely = distances < min(gate, 2.0 * miss_cost)
    rows, columns = np.flatnonzero(likely.any(axis=1)), np.flatnonzero(likely.any(axis=0))
    if not len(rows):
        return rows, columns
    near = distances[rows[:, None], columns]
    gain = np.where(near < gate, np.minimum(0.5 * near - miss_cost, 0.0), 0.0)  # eqs 5-6 and the gate
    chosen, taken = linear_sum_assignment(gain)
    real = gain[chosen, taken] < 0.0
    return rows[chosen[real]], columns[taken[real]]
