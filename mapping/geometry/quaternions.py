"""Unit quaternions (w, x, y, z), body to map, and their way between two attitudes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64

NEARLY_EQUAL = 0.9995
"""Above this cosine of half the angle between them, slerp is a straight line to 1e-7 rad."""


def product(q: ArrayLike, p: ArrayLike) -> F64:
    """Hamilton's q p: first turned by p, then by q."""
    w1, x1, y1, z1 = np.asarray(q, np.float64)
    w2, x2, y2, z2 = np.asarray(p, np.float64)
    return np.array(
        [
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ]
    )


def from_attitude(heading_rad: float, pitch_rad: float, roll_rad: float) -> F64:
    """The same rotation as ``frames.attitude_rotation``: Rz(-heading) Rx(pitch) Ry(roll)."""
    h, p, r = -heading_rad / 2, pitch_rad / 2, roll_rad / 2
    turn = (math.cos(h), 0.0, 0.0, math.sin(h))
    nose = (math.cos(p), math.sin(p), 0.0, 0.0)
    bank = (math.cos(r), 0.0, math.sin(r), 0.0)
    return product(product(turn, nose), bank)  # Miccinesi 2022, eq. 3


def rotation(q_wxyz: ArrayLike) -> F64:
    """(3, 3) of a quaternion; its length does not matter. Raises ValueError when it has none."""
    q = np.asarray(q_wxyz, np.float64)
    length = float(np.linalg.norm(q))
    if not (math.isfinite(length) and length > 0):
        raise ValueError(f"A rotation needs a finite quaternion that is not zero, got {q}.")
    w, x, y, z = q / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def heading(R_enu_body: F64) -> float:
    """Clockwise from north, of the nose: 0 to 2 pi."""
    return math.atan2(R_enu_body[0, 1], R_enu_body[1, 1]) % (2 * math.pi)


def slerp(q: ArrayLike, p: ArrayLike, share: float) -> F64:
    """The attitude at ``share`` of the shorter way from q (0) to p (1), turned at constant rate; outside it goes on."""
    a, b = np.asarray(q, np.float64), np.asarray(p, np.float64)
    cosine = float(a @ b)
    if cosine < 0:
        b, cosine = -b, -cosine
    if cosine > NEARLY_EQUAL:
        blend = a + share * (b - a)
        return blend / np.linalg.norm(blend)
    half = math.acos(min(1.0, cosine))
    return (math.sin((1 - share) * half) * a + math.sin(share * half) * b) / math.sin(half)
