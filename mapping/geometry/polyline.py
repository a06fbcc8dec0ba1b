"""A line of straight legs: how long it is, places along it, and the place that is nearest to another."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64


def along_m(points_m: F64) -> F64:
    """(K, D) points -> (K,) distance from the first to each along the legs; give two columns for that over ground."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points_m, axis=0), axis=1))])


def length_m(points_m: F64) -> float:
    return float(np.linalg.norm(np.diff(points_m, axis=0), axis=1).sum())


class Polyline:
    """Distances along it are in all of its dimensions; points may repeat."""

    def __init__(self, points_m: ArrayLike) -> None:
        self.points_m = np.array(points_m, np.float64)
        """(K, 2 or 3)"""
        self.along_m = along_m(self.points_m)
        """(K,) of the points."""

    def leg(self, along_m: float) -> int:
        """Number of the leg there; at a point the one that begins there."""
        k = int(np.searchsorted(self.along_m, along_m, side="right")) - 1
        return max(0, min(k, len(self.points_m) - 2))

    def at(self, along_m: float) -> F64:
        """The place there; beyond an end, the end."""
        if not 0.0 < along_m < self.along_m[-1]:
            return self.points_m[0 if along_m <= 0.0 else -1]
        k = self.leg(along_m)
        share = (along_m - self.along_m[k]) / (self.along_m[k + 1] - self.along_m[k])
        return self.points_m[k] + share * (self.points_m[k + 1] - self.points_m[k])

    def between(self, from_m: float, to_m: float) -> F64:
        """The part of the line, both ends included."""
        inside = (self.along_m > from_m) & (self.along_m < to_m)
        return np.vstack([self.at(from_m), self.points_m[inside], self.at(to_m)])

    def ahead(self, along_m: float, length_m: float) -> F64:
        """So much of it from there on, or what is left."""
        return self.between(along_m, min(along_m + length_m, float(self.along_m[-1])))

    def nearest(self, place_m: F64, from_m: float = -math.inf, to_m: float = math.inf) -> tuple[float, float]:
        """(distance along, distance away) of the first nearest place, of the legs that touch that part of the line."""
        return _nearest(self.points_m, self.along_m, place_m, from_m, to_m)


@njit(cache=True, nogil=True)
def _nearest(points, along_m, place, from_m, to_m):
    best_m, best_sq = 0.0, np.inf
    for k in range(points.shape[0] - 1):
        if along_m[k + 1] < from_m or along_m[k] > to_m:
            continue
        length_sq, passed = 0.0, 0.0
        for axis in range(points.shape[1]):
            d = points[k + 1, axis] - points[k, axis]
            length_sq += d * d
            passed += (place[axis] - points[k, axis]) * d
        share = 0.0
        if length_sq > 0.0:
            share = min(1.0, max(0.0, passed / length_sq))
        sq = 0.0
        for axis in range(points.shape[1]):
            away = points[k, axis] + share * (points[k + 1, axis] - points[k, axis]) - place[axis]
            sq += away * away
        if sq < best_sq:
            best_sq, best_m = sq, along_m[k] + share * (along_m[k + 1] - along_m[k])
    return best_m, math.sqrt(best_sq)
