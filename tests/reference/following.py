"""Where a position is against a line, slowly: from places close together along it."""

from __future__ import annotations

import itertools

import numpy as np

from mapping.geometry.arrays import F64


def sampled_line(points_m: F64, step_m: float) -> F64:
    """(S, 3) places at most ``step_m`` apart along the polyline."""
    parts = []
    for a, b in itertools.pairwise(points_m):
        count = max(2, int(np.ceil(np.linalg.norm(b - a) / step_m)) + 1)
        parts.append(a + np.linspace(0.0, 1.0, count)[:, None] * (b - a))
    return np.vstack(parts)


def cross_track(points_m: F64, xyz_m: F64, step_m: float) -> float:
    """Smallest horizontal distance of one position to the line: at most half a step too much."""
    places = sampled_line(points_m, step_m)
    return float(np.hypot(*(places[:, :2] - xyz_m[:2]).T).min())


def height_error(points_m: F64, xyz_m: F64, step_m: float) -> float:
    """Height above the horizontally nearest place."""
    places = sampled_line(points_m, step_m)
    nearest = int(np.argmin(np.hypot(*(places[:, :2] - xyz_m[:2]).T)))
    return float(xyz_m[2] - places[nearest, 2])


def lag(planned_m: F64, planned_s: F64, flown_m: F64, flown_s: F64, step_m: float) -> float:
    """Mean time by which a flight (distance over time) is later than its plan, place by place."""
    late = []
    for place in np.arange(step_m / 2, planned_m[-1], step_m):
        first = int(np.argmax(flown_m > place))
        share = (place - flown_m[first - 1]) / (flown_m[first] - flown_m[first - 1])
        when = flown_s[first - 1] + share * (flown_s[first] - flown_s[first - 1])
        late.append(when - np.interp(place, planned_m, planned_s))
    return float(np.mean(late))
