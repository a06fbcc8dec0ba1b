"""Places along a line: evenly spaced on every leg, both ends included."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64


def places_along(points_m: F64, step_m: float) -> tuple[F64, F64]:
    """Places at most ``step_m`` apart along the (K, 3) polyline, every vertex among them.

    Returns (M, 3) places and (M,) the horizontal distance flown up to each.
    """
    legs = np.diff(points_m, axis=0)
    parts = np.maximum(1, np.ceil(np.linalg.norm(legs, axis=1) / step_m)).astype(np.int64)
    leg = np.repeat(np.arange(len(legs)), parts)
    share = (np.arange(len(leg)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[leg]
    places = points_m[:-1][leg] + share[:, None] * legs[leg]
    s_m = distance_flown(points_m)
    along = s_m[:-1][leg] + share * np.diff(s_m)[leg]
    return np.vstack([places, points_m[-1:]]), np.append(along, s_m[-1])


def distance_flown(points_m: F64) -> F64:
    """(K,) horizontal distance from the first of (K, 3) points to each."""
    steps = np.hypot(*np.diff(points_m[:, :2], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])
