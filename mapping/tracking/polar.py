"""Filters whose states are range, bearing from north and their rates (Wessendorp 2021, III-B), relative to the vehicle.

The model is linear, as in the paper: that a straight line is no constant rate of bearing is left to the noise.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from mapping.tracking.cartesian import NEAREST_M, carry
from mapping.tracking.kalman import FULL_TURN, centred


@njit(cache=True, nogil=True)
def predict(x, P, dt_s, acceleration_m_s2, change):
    """States (N, 4) and covariances (N, 4, 4) in place, ``dt_s`` later.

    ``change`` (2,) of the vehicle's own velocity over ground since then is taken out of the rates: they are relative.
    """
    half = 0.5 * dt_s * dt_s
    for i in range(x.shape[0]):
        for a in range(2):
            x[i, a] += dt_s * x[i, a + 2]
        if x[i, 0] < 0.0:
            x[i, 0], x[i, 1], x[i, 2] = -x[i, 0], x[i, 1] + math.pi, -x[i, 2]
        x[i, 0] = max(x[i, 0], NEAREST_M)
        x[i, 1] = centred(x[i, 1], FULL_TURN)
        s, c = math.sin(x[i, 1]), math.cos(x[i, 1])
        x[i, 2] -= change[0] * s + change[1] * c
        x[i, 3] -= (change[0] * c - change[1] * s) / x[i, 0]
        carry(P[i], dt_s)
        for a in range(2):
            size = acceleration_m_s2 if a == 0 else acceleration_m_s2 / x[i, 0]
            P[i, a, a] += size * size * half * half
            P[i, a, a + 2] += size * size * half * dt_s
            P[i, a + 2, a] += size * size * half * dt_s
            P[i, a + 2, a + 2] += size * size * dt_s * dt_s


@njit(cache=True, nogil=True)
def expected(x):
    """What the radar would measure of each state: (N, 3) range, bearing, radial speed; and derivatives (N, 3, 4)."""
    n = x.shape[0]
    z = x[:, :3].copy()
    H = np.zeros((n, 3, 4))
    for k in range(3):
        H[:, k, k] = 1.0
    return z, H


@njit(cache=True, nogil=True)
def begin(z, R, own, speed_m_s):
    """States of objects of which only one detection (N, 3) with variances (N, 3) is known: across it they stand still.

    ``own`` (4,) is the vehicle's place and velocity. A radial speed that is not known (NaN) is that of an object that
    stands still.
    """
    n = z.shape[0]
    x = np.empty((n, 4))
    P = np.zeros((n, 4, 4))
    unknown = speed_m_s * speed_m_s
    for i in range(n):
        s, c = math.sin(z[i, 1]), math.cos(z[i, 1])
        r = max(z[i, 0], NEAREST_M)
        known = not math.isnan(z[i, 2])
        x[i, 0], x[i, 1] = r, z[i, 1]
        x[i, 2] = z[i, 2] if known else -(s * own[2] + c * own[3])
        x[i, 3] = -(c * own[2] - s * own[3]) / r
        P[i, 0, 0], P[i, 1, 1] = R[i, 0], R[i, 1]
        P[i, 2, 2] = R[i, 2] if known else unknown
        P[i, 3, 3] = unknown / (r * r)
    return x, P


@njit(cache=True, nogil=True)
def to_enu(x, P, own):
    """Place and velocity over ground (N, 4) and their covariances (N, 4, 4) of polar states."""
    n = x.shape[0]
    out = np.empty((n, 4))
    J = np.zeros((4, 4))
    cov = np.empty((n, 4, 4))
    for i in range(n):
        r, rate, turn = x[i, 0], x[i, 2], x[i, 3]
        s, c = math.sin(x[i, 1]), math.cos(x[i, 1])
        out[i, 0], out[i, 1] = own[0] + r * s, own[1] + r * c
        out[i, 2], out[i, 3] = own[2] + rate * s + r * turn * c, own[3] + rate * c - r * turn * s
        J[0, 0], J[0, 1] = s, r * c
        J[1, 0], J[1, 1] = c, -r * s
        J[2, 0], J[2, 1], J[2, 2], J[2, 3] = turn * c, rate * c - r * turn * s, s, r * c
        J[3, 0], J[3, 1], J[3, 2], J[3, 3] = -turn * s, -rate * s - r * turn * c, c, -r * s
        for a in range(4):
            for b in range(4):
                total = 0.0
                for k in range(4):
                    for m in range(4):
                        total += J[a, k] * P[i, k, m] * J[b, m]
                cov[i, a, b] = total
    return out, cov
