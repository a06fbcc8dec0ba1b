"""A timed line with fewer points, and how far off its vehicle may be at any time because of that.

Douglas and Peucker's splitting (1973), the piece with the worst point first, with distances between both lines at the
same time instead of from point to chord: where the vehicle is late on a straight counts, too.
"""

from __future__ import annotations

import heapq

import numpy as np

from mapping.geometry.arrays import F64, I64
from planning.errors import ParameterError


def thinned(points_m: F64, t_s: F64, *, most: int, good_enough_m: float) -> tuple[I64, float]:
    """Indices of the points that stay, and the largest distance at one time between the two lines, metres.

    ``points_m`` (N, 3) in any frame of metres, N >= 2; ``t_s`` (N,), never falling. Both lines are straight from point
    to point. First and last stay; no more than ``most`` do, and no more than ``good_enough_m`` asks for. Both lines
    are straight between the given points, so the distance is largest at one of these.
    """
    if most < 2 or len(points_m) < 2 or t_s.shape != (len(points_m),) or (np.diff(t_s) < 0).any():
        raise ParameterError("A line to be thinned needs two points that stay, and times that never fall.")
    kept = [0, len(points_m) - 1]
    pieces = [_piece(points_m, t_s, *kept)]
    while len(kept) < most and -pieces[0][0] > good_enough_m:
        _, first, last, worst = heapq.heappop(pieces)
        kept.append(worst)
        heapq.heappush(pieces, _piece(points_m, t_s, first, worst))
        heapq.heappush(pieces, _piece(points_m, t_s, worst, last))
    return np.array(sorted(kept)), max(0.0, -pieces[0][0])


def _piece(points_m: F64, t_s: F64, first: int, last: int) -> tuple[float, int, int, int]:
    """Less the distance of its worst point, its ends, and that point."""
    if last - first < 2:
        return 0.0, first, last, first
    inner = slice(first + 1, last)
    span_s = t_s[last] - t_s[first]
    share = (t_s[inner] - t_s[first]) / span_s if span_s > 0 else np.zeros(last - first - 1)
    on_chord_m = points_m[first] + share[:, None] * (points_m[last] - points_m[first])
    off_m = np.linalg.norm(points_m[inner] - on_chord_m, axis=1)
    worst = int(np.argmax(off_m))
    return -float(off_m[worst]), first, last, first + 1 + worst
