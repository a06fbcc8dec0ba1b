"""Fewer points for a chart, without losing a spike."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


def keep_extremes(y: F64, max_points: int = 1200) -> I64:
    """Indices of at most about ``max_points`` samples: the ends, and each bucket's lowest and highest.

    NaN samples count as neither; a bucket of nothing but NaN keeps its first, so that gaps stay gaps.
    """
    if len(y) <= max_points:
        return np.arange(len(y))
    edges = np.linspace(0, len(y), max(2, max_points // 2) + 1).astype(np.int64)
    low, high = np.where(np.isnan(y), np.inf, y), np.where(np.isnan(y), -np.inf, y)
    picked = [a + k for a, b in itertools.pairwise(edges) for k in (np.argmin(low[a:b]), np.argmax(high[a:b]))]
    return np.unique(np.array([0, len(y) - 1, *picked], dtype=np.int64))
