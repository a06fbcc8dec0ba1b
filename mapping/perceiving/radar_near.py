"""Which radar targets are near each other: in place, and so that one may be the other's ghost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, Bools

Column = tuple[int, int]
"""One metre wide, seen from above."""


def columns(points_enu: F64) -> list[Column]:
    """Of points (N, 3)."""
    return list(zip(*cells(points_enu[:, :2], 1.0), strict=True))


def cells(points: F64, edge_m: float) -> list[list[int]]:
    """(N, K) places -> K lists of N whole numbers: flat ones, since a thousand small objects wake the collector."""
    return [np.floor(axis / edge_m).astype(np.int64).tolist() for axis in points.T]


@dataclass(frozen=True, slots=True)
class Weighted:
    """Targets of one frame with their weights, put in order along the axis on which they lie farthest apart."""

    axis: int
    """0 east, 1 north."""
    along: F64
    """(N,) rising"""
    across: F64
    """(N,)"""
    weight: F64
    """(N,)"""

    def heaviest_near(self, points_enu: F64, within_m: float) -> F64:
        """(M,) largest weight within so much of each point (M, 3), seen from above; 0 where none is."""
        found = np.zeros(len(points_enu))
        if len(self.along):
            points = np.ascontiguousarray(points_enu[:, (self.axis, 1 - self.axis)])
            _heaviest_near(points, self.along, self.across, self.weight, within_m, found)
        return found


def weighted(points_enu: F64, weight: F64) -> Weighted:
    """Of points (N, 3) and weights (N,)."""
    if not len(points_enu):
        return Weighted(0, np.empty(0), np.empty(0), np.empty(0))
    axis = int(np.argmax(np.ptp(points_enu[:, :2], axis=0)))
    order = np.argsort(points_enu[:, axis], kind="stable")
    return Weighted(axis, points_enu[order, axis], points_enu[order, 1 - axis], weight[order])


@njit(cache=True, nogil=True)
def _heaviest_near(points, along, across, weight, within, found):
    heaviest = weight.max()
    for i in range(points.shape[0]):
        first, behind = 0, along.shape[0]
        while first < behind:
            middle = (first + behind) // 2
            if points[i, 0] - along[middle] > within:
                first = middle + 1
            else:
                behind = middle
        for j in range(first, along.shape[0]):
            a, b = points[i, 0] - along[j], points[i, 1] - across[j]
            if -a > within or found[i] >= heaviest:
                break
            if a * a + b * b <= within * within:
                found[i] = max(found[i], weight[j])


def stronger_aside(
    range_m: F64, sine: F64, snr_db: F64, *, within_m: float, aside: float, width: float, by_db: float
) -> Bools:
    """(N,) Whether another one stands at the same range, ``aside`` of it as a sine of azimuth, and is stronger."""
    order = np.argsort(range_m, kind="stable")
    found = np.zeros(len(range_m), np.bool_)
    found[order] = _stronger_aside(range_m[order], sine[order], snr_db[order], within_m, aside, width, by_db)
    return found


@njit(cache=True, nogil=True)
def _stronger_aside(range_m, sine, snr_db, within, aside, width, by_db):
    """By rising range."""
    count = range_m.shape[0]
    found = np.zeros(count, np.bool_)
    first = 0
    for i in range(count):
        while range_m[i] - range_m[first] > within:
            first += 1
        for j in range(first, count):
            if range_m[j] - range_m[i] > within:
                break
            if snr_db[j] > snr_db[i] + by_db and abs(abs(sine[i] - sine[j]) - aside) <= width:
                found[i] = True
                break
    return found
