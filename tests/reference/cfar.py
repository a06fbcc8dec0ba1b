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


def caso(ring: Row, guard: int, training: int, stride: int, factor: float) -> list[bool]:
    """Which cells of a ring exceed their threshold; a side that meets or passes the cells around zero starts beyond."""
    n = len(ring)
    around_zero = {k % n for k in range(-guard * stride, guard * stride + 1)}
    found = []
    for c, here in enumerate(ring):
        means = []
        for sign in (-1, 1):
            reached = {(c + sign * k) % n for k in range((guard + 1) * stride, (guard + training) * stride + 1)}
            passed = {(c + sign * k) % n for k in range(1, (guard + 1) * stride)}
            start = 0 if reached & around_zero or 0 in passed else c
            side = [(start + sign * stride * k) % n for k in range(guard + 1, guard + training + 1)]
            means.append(sum(ring[i] for i in side) / training)
        found.append(here > factor * min(means))
    return found


def ca(ring: Row, guard: int, training: int, stride: int, factor: float) -> list[bool]:
    """Which cells of a ring exceed their threshold."""
    found = []
    for c, here in enumerate(ring):
        offsets = [stride * k for k in range(guard + 1, guard + training + 1)]
        cells = [ring[(c + sign * k) % len(ring)] for k in offsets for sign in (-1, 1)]
        found.append(here > factor * sum(cells) / len(cells))
    return found


def independent(cells: int) -> tuple[float, ...]:
    """Weights of cells that have nothing in common."""
    return (1.0,) * cells


def ca_detection(cells: float, factor: float, snr: float) -> float:
    """Probability that CA-CFAR sees a fluctuating target (Swerling 1) of mean ``snr`` (a ratio), with one look."""
    return (1.0 + factor / (cells * (1.0 + snr))) ** -cells
