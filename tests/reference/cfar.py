"""CFAR written slowly: cell by cell, and the false-alarm probabilities as printed for one look (Rohling 1983)."""

from __future__ import annotations

import math

Row = list[float]


def ca_false_alarm(cells: int, factor: float) -> float:
    """Cell averaging over ``cells`` cells."""
    return (1.0 + factor / cells) ** -cells


def caso_false_alarm(cells: int, factor: float) -> float:
    """Smallest of two sides of ``cells`` cells each."""
    a = factor / cells
    return 2.0 * sum(math.comb(cells + k - 1, k) * (2.0 + a) ** -(cells + k) for k in range(cells))


def caso(row: Row, guard: int, training: int, stride: int, both: float, one: float) -> list[bool]:
    """Which cells of a line with two ends exceed their threshold."""
    found = []
    for c, here in enumerate(row):
        offsets = [stride * k for k in range(guard + 1, guard + training + 1)]
        sides = [[c - k for k in offsets], [c + k for k in offsets]]
        whole = [side for side in sides if min(side) >= 0 and max(side) < len(row)]
        means = [sum(row[i] for i in side) / training for side in whole]
        found.append(here > (both if len(means) == 2 else one) * min(means))
    return found


def ca(ring: Row, guard: int, training: int, stride: int, factor: float) -> list[bool]:
    """Which cells of a ring exceed their threshold."""
    found = []
    for c, here in enumerate(ring):
        offsets = [stride * k for k in range(guard + 1, guard + training + 1)]
        cells = [ring[(c + sign * k) % len(ring)] for k in offsets for sign in (-1, 1)]
        found.append(here > factor * sum(cells) / len(cells))
    return found
