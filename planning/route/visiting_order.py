"""The shortest order in which to visit points, the first staying first and the last free."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64

EXACT_UP_TO = 9
MIN_GAIN_M = 1e-9


def shortest_order(xy_m: F64) -> list[int]:
    """Indices of the points (N, 2) in a short flying order that starts with point 0.

    Exact for up to nine points (Held and Karp's dynamic programming); for more, nearest neighbour
    improved by 2-opt (reversing a stretch) and or-opt (moving up to three points) until neither helps.
    """
    points = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
    apart = np.hypot(points[:, None, 0] - points[None, :, 0], points[:, None, 1] - points[None, :, 1])
    if len(points) <= 2:
        return list(range(len(points)))
    return _held_karp(apart) if len(points) <= EXACT_UP_TO else _improved(apart, _nearest(apart))


def _held_karp(apart: F64) -> list[int]:
    """Cheapest way through every subset, by its last point."""
    count = len(apart)
    best = {(1 << j, j): (float(apart[0, j]), 0) for j in range(1, count)}
    full = (1 << count) - 2
    for visited in range(2, full + 1, 2):
        for last in (j for j in range(1, count) if visited >> j & 1 and visited != 1 << j):
            before = visited & ~(1 << last)
            best[visited, last] = min(
                (best[before, j][0] + float(apart[j, last]), j) for j in range(1, count) if before >> j & 1
            )
    visited, last = full, min(range(1, count), key=lambda j: best[full, j][0])
    order = []
    while last:
        order.append(last)
        visited, last = visited & ~(1 << last), best[visited, last][1]
    return [0, *reversed(order)]


def _nearest(apart: F64) -> list[int]:
    order, left = [0], set(range(1, len(apart)))
    while left:
        order.append(min(left, key=lambda j: apart[order[-1], j]))
        left.remove(order[-1])
    return order


def _improved(apart: F64, order: list[int]) -> list[int]:
    while (better := _two_opt(apart, order) or _or_opt(apart, order)) is not None:
        order = better
    return order


def _two_opt(apart: F64, order: list[int]) -> list[int] | None:
    """The best reversal of a stretch, if it shortens the way; the end of an open way costs nothing to join."""
    o = np.array(order)
    step = apart[o[:-1], o[1:]]
    after = np.append(step, 0.0)
    cross = apart[np.ix_(o, o)]
    join = np.zeros((len(o), len(o)))
    join[1:, :-1] = cross[1:, 1:]
    gain = np.full((len(o), len(o)), -np.inf)
    i, j = np.triu_indices(len(o), k=1)
    keep = i >= 1
    i, j = i[keep], j[keep]
    gain[i, j] = step[i - 1] + after[j] - cross[i - 1, j] - join[i, j]
    i, j = (int(k) for k in np.unravel_index(np.argmax(gain), gain.shape))
    return order[:i] + order[i : j + 1][::-1] + order[j + 1 :] if gain[i, j] > MIN_GAIN_M else None


def _or_opt(apart: F64, order: list[int]) -> list[int] | None:
    """The first move of one to three points to another place that shortens the way."""
    length_m = _length(apart, order)
    for size in (1, 2, 3):
        for start in range(1, len(order) - size + 1):
            part, rest = order[start : start + size], order[:start] + order[start + size :]
            o = np.array([*rest, -1])
            free = np.arange(1, len(rest) + 1)
            tail = np.where(free < len(rest), apart[part[-1], o[free]], 0.0)
            gap = np.where(free < len(rest), apart[o[free - 1], o[free]], 0.0)
            total = _length(apart, rest) + _length(apart, part) + apart[o[free - 1], part[0]] + tail - gap
            place = int(free[np.argmin(total)])
            if total.min() < length_m - MIN_GAIN_M:
                return rest[:place] + part + rest[place:]
    return None


def _length(apart: F64, order: list[int]) -> float:
    return float(apart[order[:-1], order[1:]].sum())
