"""Obstacles: clusters of occupied voxels, and what an operator must know about each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, I64

MOST_VOXELS = 2000
"""Of one search that are clustered, the nearest: a wall that fills the region is no less an obstacle for it."""
SECTORS = 72
"""Of the polar display, 5 degrees each."""
CLOSING_M_S = 0.1
"""Slower than this nothing is getting nearer."""

RegionName = Literal["roi", "corridor"]


@dataclass(frozen=True, slots=True)
class Found:
    """A cluster of occupied voxels; distances and directions are those of its nearest voxel's centre."""

    region: RegionName
    distance_m: float
    bearing_rad: float
    """Clockwise from north, 0 to 2 pi."""
    off_nose_rad: float
    """Clockwise from the heading, -pi to pi."""
    height_difference_m: float
    """Top of the cluster above the vehicle."""
    time_to_contact_s: float | None
    enu_m: tuple[float, float, float]
    low_enu_m: tuple[float, float, float]
    """Least corner of the cluster's box, edges of voxels."""
    high_enu_m: tuple[float, float, float]
    voxels: int

    @property
    def size_m(self) -> tuple[float, float, float]:
        low, high = self.low_enu_m, self.high_enu_m
        return high[0] - low[0], high[1] - low[1], high[2] - low[2]


def clusters(centres_enu: F64, resolution_m: float) -> I64:
    """(N, 3) voxel centres -> (N,) number of the cluster of each: voxels that touch, corners included, are one."""
    keys = np.floor(np.asarray(centres_enu, np.float64).reshape(-1, 3) / resolution_m).astype(np.int64)
    return _label(keys)


@njit(cache=True, nogil=True)
def _label(keys):
    n = keys.shape[0]
    label = np.full(n, -1, np.int64)
    stack = np.empty(n, np.int64)
    count = 0
    for first in range(n):
        if label[first] >= 0:
            continue
        label[first], stack[0], size = count, first, 1
        while size > 0:
            size -= 1
            k = stack[size]
            for j in range(n):
                if (
                    label[j] < 0
                    and abs(keys[j, 0] - keys[k, 0]) <= 1
                    and abs(keys[j, 1] - keys[k, 1]) <= 1
                    and abs(keys[j, 2] - keys[k, 2]) <= 1
                ):
                    label[j] = count
                    stack[size] = j
                    size += 1
        count += 1
    return label


def obstacles(
    centres_enu: F64,
    *,
    region: RegionName,
    resolution_m: float,
    position_enu_m: F64,
    velocity_enu_m_s: F64,
    heading_rad: float,
) -> list[Found]:
    """Clusters of (N, 3) occupied voxels as a vehicle sees them, the nearest first."""
    centres = np.asarray(centres_enu, np.float64).reshape(-1, 3)
    away_m = np.linalg.norm(centres - position_enu_m, axis=1)
    nearest = np.argsort(away_m, kind="stable")[:MOST_VOXELS]
    centres, away_m = centres[nearest], away_m[nearest]
    labels = clusters(centres, resolution_m)
    found = []
    for name in range(int(labels.max(initial=-1)) + 1):
        mine = labels == name
        found.append(
            _found(
                centres[mine],
                float(away_m[mine][0]),
                region,
                resolution_m,
                position_enu_m,
                velocity_enu_m_s,
                heading_rad,
            )
        )
    return sorted(found, key=lambda f: f.distance_m)


def _found(
    centres: F64, distance_m: float, region: RegionName, resolution_m: float, p: F64, v: F64, heading_rad: float
) -> Found:
    """``centres`` with the nearest first."""
    towards = centres[0] - p
    low, high = centres.min(axis=0) - resolution_m / 2, centres.max(axis=0) + resolution_m / 2
    bearing = math.atan2(towards[0], towards[1]) % (2 * math.pi)
    return Found(
        region,
        distance_m,
        bearing,
        math.remainder(bearing - heading_rad, 2 * math.pi),
        float(high[2] - p[2]),
        time_to_contact_s(towards, v),
        _triple(centres[0]),
        _triple(low),
        _triple(high),
        len(centres),
    )


def time_to_contact_s(towards_m: F64, velocity_m_s: F64) -> float | None:
    """Until a fixed place is reached at the present closing speed; None while it is not getting nearer."""
    distance_m = float(np.linalg.norm(towards_m))
    if distance_m == 0:
        return 0.0
    closing = float(velocity_m_s @ towards_m) / distance_m
    return distance_m / closing if closing > CLOSING_M_S else None


def _triple(p: F64) -> tuple[float, float, float]:
    return float(p[0]), float(p[1]), float(p[2])


def sweep(
    centres_enu: F64, *, position_enu_m: F64, heading_rad: float, within_height_m: float = 5.0
) -> tuple[float | None, ...]:
    """Horizontal distance of the nearest voxel in each of 72 sectors, clockwise from the nose; None where none is.

    The first sector is centred on the nose; only voxels within ``within_height_m`` of the vehicle's height count.
    """
    nearest = _sweep(np.ascontiguousarray(centres_enu, np.float64), position_enu_m, heading_rad, within_height_m)
    return tuple(float(m) if math.isfinite(m) else None for m in nearest)


@njit(cache=True, nogil=True)
def _sweep(centres, p, heading_rad, within_m):
    nearest = np.full(SECTORS, np.inf)
    width = 2 * math.pi / SECTORS
    for k in range(centres.shape[0]):
        if abs(centres[k, 2] - p[2]) > within_m:
            continue
        e, n = centres[k, 0] - p[0], centres[k, 1] - p[1]
        sector = math.floor((math.atan2(e, n) - heading_rad) / width + 0.5) % SECTORS
        nearest[sector] = min(nearest[sector], math.sqrt(e * e + n * n))
    return nearest
