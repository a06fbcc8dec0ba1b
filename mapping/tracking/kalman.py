"""The Kalman filters' common part: what a detection is off, how likely that is, and what it changes."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

FULL_TURN = 2.0 * math.pi
RANGE, BEARING, EDGE, BEARING_BEYOND, SPEED, EXTENT, FOLDED = range(7)
"""Of ``TrackerParams.noise``."""


@njit(cache=True, nogil=True)
def centred(value, period):
    """The same up to whole periods, between minus and plus half of one."""
    return value - period * math.floor(value / period + 0.5)


@njit(cache=True, nogil=True)
def variances(z, heading_rad, noise):
    """(N, 3) of detections at ``z`` (N, 3): range, bearing from north, radial speed. The extent is part of them."""
    out = np.empty((z.shape[0], 3))
    extent = noise[EXTENT] * noise[EXTENT]
    for i in range(z.shape[0]):
        off = abs(centred(z[i, 1] - heading_rad, FULL_TURN))
        bearing = noise[BEARING] if off <= noise[EDGE] else noise[BEARING_BEYOND]
        out[i, 0] = noise[RANGE] * noise[RANGE] + extent
        out[i, 1] = bearing * bearing + extent / max(z[i, 0] * z[i, 0], extent + 1e-6)
        out[i, 2] = noise[SPEED] * noise[SPEED]
    return out


@njit(cache=True, nogil=True)
def spreads(P, H, R):
    """(N,) largest variance of the place, in any direction, over that of one detection with variances ``R`` (N, 3)."""
    out = np.empty(P.shape[0])
    for i in range(P.shape[0]):
        rr = _form(P[i], H[i], 0, 0) / R[i, 0]
        bb = _form(P[i], H[i], 1, 1) / R[i, 1]
        rb = _form(P[i], H[i], 0, 1) / math.sqrt(R[i, 0] * R[i, 1])
        out[i] = 0.5 * (rr + bb) + math.hypot(0.5 * (rr - bb), rb)
    return out


@njit(cache=True, nogil=True)
def distances(z, P, H, R, found, folded_m_s, gate):
    """(N, M) squared distance of each detection ``found`` (M, 3) from each expected ``z``, in sigmas (eq. 6).

    Infinite where range or bearing alone put it beyond the gate: of a thousand detections only the near ones cost time.
    """
    n, m = z.shape[0], found.shape[0]
    out = np.full((n, m), math.inf)
    off = np.empty(3)
    for i in range(n):
        S = _innovation(P[i], H[i], R[i])
        inverse, without = _inverse(S, True), _inverse(S, False)
        reach_m, reach_rad = math.sqrt(gate * S[0, 0]), math.sqrt(gate * S[1, 1])
        for j in range(m):
            if abs(found[j, 0] - z[i, 0]) > reach_m:
                continue
            _difference(found[j], z[i], folded_m_s, off)
            if abs(off[1]) > reach_rad:
                continue
            W = without if math.isnan(found[j, 2]) else inverse
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += off[a] * W[a, b] * off[b]  # Wessendorp 2021, eq. 6
            out[i, j] = total
    return out


@njit(cache=True, nogil=True)
def update(x, P, z, H, R, found, which, taken, folded_m_s):
    """States ``which`` (K,) and covariances in place, each by its own detection ``taken`` (K,) of ``found``."""
    off = np.empty(3)
    K = np.empty((4, 3))
    for k in range(which.shape[0]):
        i, j = which[k], taken[k]
        S = _innovation(P[i], H[i], R[i])
        W = _inverse(S, not math.isnan(found[j, 2]))
        _difference(found[j], z[i], folded_m_s, off)
        for a in range(4):
            for b in range(3):
                K[a, b] = 0.0
                for c in range(3):
                    for d in range(4):
                        K[a, b] += P[i, a, d] * H[i, c, d] * W[c, b]
        for a in range(4):
            for b in range(3):
                x[i, a] += K[a, b] * off[b]
        _shrink(P[i], K, S)


@njit(cache=True, nogil=True)
def _shrink(P, K, S):
    """P - K S K', the same on both sides of its diagonal."""
    for a in range(4):
        for b in range(a, 4):
            total = 0.5 * (P[a, b] + P[b, a])
            for c in range(3):
                for d in range(3):
                    total -= K[a, c] * S[c, d] * K[b, d]
            P[a, b] = P[b, a] = total


@njit(cache=True, nogil=True)
def _difference(found, z, folded_m_s, off):
    off[0] = found[0] - z[0]
    off[1] = centred(found[1] - z[1], FULL_TURN)
    rate = 0.0 if math.isnan(found[2]) else found[2] - z[2]
    off[2] = centred(rate, folded_m_s) if math.isfinite(folded_m_s) else rate


@njit(cache=True, nogil=True)
def _form(P, H, a, b):
    """H_a P H_b'."""
    total = 0.0
    for k in range(4):
        for m in range(4):
            total += H[a, k] * P[k, m] * H[b, m]
    return total


@njit(cache=True, nogil=True)
def _innovation(P, H, R):
    S = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            S[a, b] = _form(P, H, a, b)
        S[a, a] += R[a]
    return S


@njit(cache=True, nogil=True)
def _inverse(S, with_rate):
    """Of a symmetric S (3, 3); without the rate: of its first two rows and columns, zero elsewhere."""
    W = np.zeros((3, 3))
    if not with_rate:
        det = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
        W[0, 0], W[1, 1] = S[1, 1] / det, S[0, 0] / det
        W[0, 1] = W[1, 0] = -S[0, 1] / det
        return W
    for a in range(3):
        for b in range(3):
            c, d, e, f = (a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3
            W[b, a] = S[c, e] * S[d, f] - S[c, f] * S[d, e]
    det = S[0, 0] * W[0, 0] + S[0, 1] * W[1, 0] + S[0, 2] * W[2, 0]
    for a in range(3):
        for b in range(3):
            W[a, b] /= det
    return W
