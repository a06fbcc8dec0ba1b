"""Fewer points of a curve, with a promise of how far the rest strays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planning.model import F64


def kept_within(
    s: F64, value: F64, tolerance: float, *, must_keep: NDArray[np.int64] | None = None
) -> NDArray[np.intp]:
    """Indices between which straight lines stay within ``tolerance`` of every value (Douglas and Peucker 1973)."""
    ends = np.unique(np.r_[0, len(s) - 1, [] if must_keep is None else must_keep].astype(np.intp))
    kept = set(ends.tolist())
    stretches = list(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))
    while stretches:
        first, last = stretches.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        length = s[last] - s[first]
        share = (s[inner] - s[first]) / length if length > 0 else np.zeros(last - first - 1)
        off = np.abs(value[first] + share * (value[last] - value[first]) - value[inner])
        worst = first + 1 + int(np.argmax(off))
        if off[worst - first - 1] > tolerance:
            kept.add(worst)
            stretches += [(first, worst), (worst, last)]
    return np.array(sorted(kept), dtype=np.intp)
