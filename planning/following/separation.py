"""How near two moving vehicles come to each other: two lines with times, held against each other at the worse end.

Where each vehicle is at a time is known within a ball that grows, and when it is at a place within a span that grows.
The distance is the smallest of all pairs of places at which both can be at once, less both balls. It is never larger
than the true one: each line is cut into short pieces, and a piece counts with the largest ball and span of its ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, I64
from planning.errors import ParameterError

PIECE_S, MOST_PIECES = 0.5, 400
"""A piece takes no longer: by what the balls grow in it the answer may be too small. Of a line that takes longer than
so many of them they are longer: each is held against each of the other's, and lines begin where a vehicle was last
heard, maybe an hour ago."""
_TINY_M2 = 1e-12
_ROUNDING_M = 1e-6


@dataclass(frozen=True, slots=True)
class TimedLine:
    """Straight from point to point, each at its time."""

    points_enu_m: F64
    """(N, 3), N >= 2, in a frame that both lines share"""
    t_s: F64
    """(N,) seconds on a clock that both lines share; never falling"""
    radius_m: float
    """Of the ball in which the vehicle is at ``t_s[0]``."""
    spread_m_s: float = 0.0
    """What the ball's radius grows by."""
    early_late_s: float = 0.0
    """So much earlier or later than ``t_s`` says it may be at a place, at ``t_s[0]``."""
    early_late_share: float = 0.0
    """What that grows by in each second."""

    def __post_init__(self) -> None:
        points_m, t_s = self.points_enu_m, self.t_s
        if points_m.ndim != 2 or points_m.shape[1] != 3 or len(points_m) < 2 or t_s.shape != (len(points_m),):
            raise ParameterError(
                f"A timed line needs at least two points with a time each, not {points_m.shape} and {t_s.shape}."
            )
        if not (np.isfinite(points_m).all() and np.isfinite(t_s).all() and (np.diff(t_s) >= 0).all()):
            raise ParameterError("A timed line needs finite points, and times that never fall.")
        if min(self.radius_m, self.spread_m_s, self.early_late_s, self.early_late_share) < 0:
            raise ParameterError("What is not known of a timed line cannot be less than nothing.")


@dataclass(frozen=True, slots=True)
class Nearest:
    distance_m: float
    """Between the balls, 0 where they may touch."""
    t_s: float
    """When, in the middle of what is possible."""
    at_enu_m: tuple[float, float, float]
    """Half way between both lines."""


def ways_apart(a_enu_m: F64, b_enu_m: F64, *, radius_m: float) -> Nearest:
    """The same whenever either is flown: of two ways through points (N, 3), each with a ball of ``radius_m``."""
    first, second = (TimedLine(points_m, np.zeros(len(points_m)), radius_m) for points_m in (a_enu_m, b_enu_m))
    found = nearest(first, second)
    assert found is not None, "both are under way at their one moment"
    return found


def nearest(a: TimedLine, b: TimedLine, *, since_s: float = -math.inf) -> Nearest | None:
    """None when there is no time from ``since_s`` on at which both are under way."""
    pieces_a, pieces_b = _pieces(a, since_s), _pieces(b, since_s)
    together = (pieces_a.from_s[:, None] <= pieces_b.until_s) & (pieces_b.from_s <= pieces_a.until_s[:, None])
    i, j = np.nonzero(together)
    if not len(i):
        return None
    i, j = _worth_a_look(pieces_a, pieces_b, i, j)
    apart_m, middle_m = _between(pieces_a.start_m[i], pieces_a.end_m[i], pieces_b.start_m[j], pieces_b.end_m[j])
    clear_m = apart_m - pieces_a.radius_m[i] - pieces_b.radius_m[j]
    clear_m = np.maximum(clear_m, 0.0)
    t_s = (
        np.maximum(pieces_a.from_s[i], pieces_b.from_s[j]) + np.minimum(pieces_a.until_s[i], pieces_b.until_s[j])
    ) / 2
    # Of places that are equally near, the first one.
    k = int(np.lexsort((t_s, clear_m))[0])
    x, y, z = middle_m[k].tolist()
    return Nearest(float(clear_m[k]), float(t_s[k]), (x, y, z))


@dataclass(frozen=True, slots=True)
class _Pieces:
    start_m: F64
    end_m: F64
    from_s: F64
    until_s: F64
    """When the vehicle may be on the piece."""
    radius_m: F64


def _pieces(line: TimedLine, since_s: float) -> _Pieces:
    """Those on which the vehicle may be from ``since_s`` on."""
    piece_s = max(PIECE_S, float(line.t_s[-1] - line.t_s[0]) / MOST_PIECES)
    counts = np.maximum(1, np.ceil(np.diff(line.t_s) / piece_s).astype(int))
    whole = np.repeat(np.arange(len(counts)), counts)
    within = np.arange(len(whole)) - np.repeat(np.cumsum(counts) - counts, counts)

    def at(share: F64) -> tuple[F64, F64]:
        points_m = line.points_enu_m
        step_m, step_s = points_m[whole + 1] - points_m[whole], line.t_s[whole + 1] - line.t_s[whole]
        return points_m[whole] + share[:, None] * step_m, line.t_s[whole] + share * step_s

    (start_m, start_s), (end_m, end_s) = at(within / counts[whole]), at((within + 1) / counts[whole])
    gone_s = end_s - line.t_s[0]
    span_s = line.early_late_s + line.early_late_share * gone_s
    from_s, until_s = np.maximum(start_s - span_s, since_s), end_s + span_s
    radius_m, on = line.radius_m + line.spread_m_s * gone_s, until_s >= since_s
    return _Pieces(start_m[on], end_m[on], from_s[on], until_s[on], radius_m[on])


def _worth_a_look(a: _Pieces, b: _Pieces, i: I64, j: I64) -> tuple[I64, I64]:
    """Without pairs whose boxes are farther apart than the beginnings of some other pair."""
    radii_m = a.radius_m[i] + b.radius_m[j]
    enough_m = max(0.0, float((np.linalg.norm(a.start_m[i] - b.start_m[j], axis=1) - radii_m).min()))
    low_a, high_a = np.minimum(a.start_m, a.end_m), np.maximum(a.start_m, a.end_m)
    low_b, high_b = np.minimum(b.start_m, b.end_m), np.maximum(b.start_m, b.end_m)
    gap_m = np.maximum(np.maximum(low_a[i] - high_b[j], low_b[j] - high_a[i]), 0.0)
    near = np.linalg.norm(gap_m, axis=1) - radii_m <= enough_m + _ROUNDING_M
    return i[near], j[near]


def _between(p: F64, q: F64, r: F64, s: F64) -> tuple[F64, F64]:
    """(K,) distances from segments p-q to segments r-s, and (K, 3) half way between their nearest points."""
    # Of two segments that do not cross, an end of one is nearest: that also mends what is nearly parallel.
    found = [_crossing(p, q, r, s)]
    for end, start, stop, swapped in ((p, r, s, False), (q, r, s, False), (r, p, q, True), (s, p, q, True)):
        on = _on_segment(end, start, stop)
        found.append((on, end) if swapped else (end, on))
    apart_m = np.stack([np.linalg.norm(one - other, axis=1) for one, other in found])
    middles_m = np.stack([(one + other) / 2 for one, other in found])
    best = apart_m.argmin(axis=0)
    each = np.arange(len(best))
    return apart_m[best, each], middles_m[best, each]


def _on_segment(point: F64, start: F64, end: F64) -> F64:
    step = end - start
    length2 = (step * step).sum(axis=1)
    share = ((point - start) * step).sum(axis=1) / np.where(length2 > _TINY_M2, length2, 1.0)
    return start + np.clip(share, 0.0, 1.0)[:, None] * step


def _crossing(p: F64, q: F64, r: F64, s: F64) -> tuple[F64, F64]:
    """Nearest points of the two whole lines, moved onto the segments."""
    one, other, off = q - p, s - r, p - r
    a, e, b = (one * one).sum(axis=1), (other * other).sum(axis=1), (one * other).sum(axis=1)
    c, f = (one * off).sum(axis=1), (other * off).sum(axis=1)
    apart = a * e - b * b
    share = np.clip((b * f - c * e) / np.where(apart > _TINY_M2, apart, 1.0), 0.0, 1.0)
    at = p + share[:, None] * one
    return at, _on_segment(at, r, s)
