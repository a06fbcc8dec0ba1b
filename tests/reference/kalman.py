"""One step of an extended Kalman filter out of a textbook: whole matrices, derivatives by differences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mapping.geometry.arrays import F64

Measure = Callable[[F64], F64]
STEP = 1e-6


def predicted(x: F64, P: F64, dt_s: float, accelerations_m_s2: tuple[float, float]) -> tuple[F64, F64]:
    """Two axes at constant rates; an acceleration that lasts for ``dt_s`` is noise of each."""
    F = np.eye(4) + dt_s * np.eye(4, k=2)
    Q = np.zeros((4, 4))
    for axis, size in enumerate(accelerations_m_s2):
        G = np.zeros((4, 1))
        G[axis], G[axis + 2] = dt_s**2 / 2, dt_s
        Q += size**2 * (G @ G.T)
    return F @ x, F @ P @ F.T + Q


def updated(x: F64, P: F64, z: F64, R: F64, measure: Measure) -> tuple[F64, F64]:
    """``z`` (k,) with covariance ``R`` (k, k); the second number is an angle."""
    H = derivatives(measure, x)
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    off = z - measure(x)
    off[1] = math.remainder(off[1], 2 * math.pi)
    keep = np.eye(4) - K @ H
    return x + K @ off, keep @ P @ keep.T + K @ R @ K.T


def derivatives(measure: Measure, x: F64) -> F64:
    return np.column_stack([(measure(x + d) - measure(x - d)) / (2 * STEP) for d in STEP * np.eye(4)])


def range_bearing_rate(own: F64) -> Measure:
    """Of a state (east, north and their velocities), from a vehicle at ``own`` (4,); bearing from north."""

    def measure(x: F64) -> F64:
        off, rate = x[:2] - own[:2], x[2:] - own[2:]
        range_m = math.hypot(*off)
        return np.array([range_m, math.atan2(off[0], off[1]), off @ rate / range_m])

    return measure
