"""Filters whose states are place and velocity over ground: (east, north, east speed, north speed)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

NEAREST_M = 0.1
"""Nearer than this an object has no bearing."""


@njit(cache=True, nogil=True)
def carry(P, dt_s):
    """A covariance (4, 4) of two coordinates and their rates, in place, ``dt_s`` later; without noise."""
    for a in range(2):
        for k in range(4):
            P[a, k] += dt_s * P[a + 2, k]
    for k in range(4):
        for a in range(2):
            P[k, a] += dt_s * P[k, a + 2]


@njit(cache=True, nogil=True)
def predict(x, P, dt_s, acceleration_m_s2):
    """States (N, 4) and covariances (N, 4, 4) in place, ``dt_s`` later; an acceleration that lasts as long is noise."""
    half = 0.5 * dt_s * dt_s
    noise = acceleration_m_s2 * acceleration_m_s2
    for i in range(x.shape[0]):
        for a in range(2):
            x[i, a] += dt_s * x[i, a + 2]
        carry(P[i], dt_s)
        for a in range(2):
            P[i, a, a] += noise * half * half
            P[i, a, a + 2] += noise * half * dt_s
            P[i, a + 2, a] += noise * half * dt_s
            P[i, a + 2, a + 2] += noise * dt_s * dt_s


@njit(cache=True, nogil=True)
def expected(x, own):
    """What a radar with ``own`` (4,) place and velocity would measure of each state.

    (N, 3) range, bearing from north, radial speed; and its derivatives (N, 3, 4). The radial speed is relative.
    """
    n = x.shape[0]
    z = np.empty((n, 3))
    H = np.zeros((n, 3, 4))
    for i in range(n):
        e, north = x[i, 0] - own[0], x[i, 1] - own[1]
        ve, vn = x[i, 2] - own[2], x[i, 3] - own[3]
        r = max(math.hypot(e, north), NEAREST_M)
        ue, un = e / r, north / r
        rate = ue * ve + un * vn
        z[i, 0], z[i, 1], z[i, 2] = r, math.atan2(e, north), rate
        H[i, 0, 0], H[i, 0, 1] = ue, un
        H[i, 1, 0], H[i, 1, 1] = un / r, -ue / r
        H[i, 2, 0], H[i, 2, 1] = (ve - rate * ue) / r, (vn - rate * un) / r
        H[i, 2, 2], H[i, 2, 3] = ue, un
    return z, H


@njit(cache=True, nogil=True)
def begin(z, R, own, speed_m_s):
    """States of objects of which only one detection (N, 3) with variances (N, 3) is known; across it they stand still.

    A radial speed that is not known (NaN) is that of an object that stands still.
    """
    n = z.shape[0]
    x = np.empty((n, 4))
    P = np.zeros((n, 4, 4))
    unknown = speed_m_s * speed_m_s
    for i in range(n):
        s, c = math.sin(z[i, 1]), math.cos(z[i, 1])
        known = not math.isnan(z[i, 2])
        along = z[i, 2] + s * own[2] + c * own[3] if known else 0.0
        x[i, 0], x[i, 1] = own[0] + z[i, 0] * s, own[1] + z[i, 0] * c
        x[i, 2], x[i, 3] = along * s, along * c
        _fill(P[i], 0, s, c, R[i, 0], z[i, 0] * z[i, 0] * R[i, 1])
        _fill(P[i], 2, s, c, R[i, 2] if known else unknown, unknown)
    return x, P


@njit(cache=True, nogil=True)
def _fill(P, at, s, c, along, across):
    """A block whose variances are given along and across the bearing."""
    P[at, at] = along * s * s + across * c * c
    P[at + 1, at + 1] = along * c * c + across * s * s
    P[at, at + 1] = P[at + 1, at] = (along - across) * s * c
