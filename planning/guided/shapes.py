"""The lines that guided ways follow over ground: a circle, and a flown track with its needless places left out."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64

CORNERS = 36
"""Of a circle: so blunt that they are passed at some metres per second."""
BESIDE_M = 0.3
"""What is left out of a flown track lies this near to what stays."""


def circle(centre_xy_m: F64, from_xy_m: F64, radius_m: float, *, laps: int, clockwise: bool) -> F64:
    """(N, 2) corners, the first nearest to ``from_xy_m``, the last the same; as seen from above."""
    out = from_xy_m - centre_xy_m
    begins_rad = math.atan2(out[1], out[0]) if np.hypot(*out) > 1e-6 else math.pi / 2
    turn = (-1.0 if clockwise else 1.0) * np.arange(CORNERS * laps + 1) * math.tau / CORNERS
    return centre_xy_m + radius_m * np.column_stack([np.cos(begins_rad + turn), np.sin(begins_rad + turn)])


def simplified(points_m: F64) -> F64:
    """The fewest of (N, 3) points, first and last among them, that Douglas and Peucker's rule leaves."""
    keep = np.zeros(len(points_m), bool)
    keep[[0, -1]] = True
    spans = [(0, len(points_m) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        away_m = _away_m(points_m[first + 1 : last], points_m[first], points_m[last])
        worst = int(np.argmax(away_m))
        if away_m[worst] > BESIDE_M:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return points_m[keep]


def _away_m(points_m: F64, a: F64, b: F64) -> F64:
    along = b - a
    share = np.clip((points_m - a) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.linalg.norm(a + share[:, None] * along - points_m, axis=1)
