"""Clearance, slowly: every cell against densely sampled places, with nothing skipped and nothing clever.

Coordinates: metres east and SOUTH of the model's north-west corner, z up.
"""

from __future__ import annotations

import itertools

import numpy as np

from mapping.geometry.arrays import F32, F64


def sampled_segment(start_m: F64, end_m: F64, step_m: float) -> F64:
    """(S, 3) places at most ``step_m`` apart, both ends included."""
    count = int(np.ceil(np.linalg.norm(end_m - start_m) / step_m)) + 1
    return start_m + np.linspace(0.0, 1.0, max(2, count))[:, None] * (end_m - start_m)


def point_distance(elevation_m: F32, res_m: float, point_m: F64) -> float:
    """Distance of one place to the union of all columns and the outside of the model."""
    height_px, width_px = elevation_m.shape
    x, y, z = point_m
    to_outside = max(0.0, min(x, y, width_px * res_m - x, height_px * res_m - y))
    top = np.where(np.isfinite(elevation_m), elevation_m.astype(np.float64), np.inf)
    above = np.maximum(0.0, z - top)
    return min(to_outside, float(np.sqrt(_flat_distance_sq(elevation_m.shape, res_m, x, y) + above**2).min()))


def sampled_distance(elevation_m: F32, res_m: float, places_m: F64) -> float:
    """Smallest of the places' distances: at most half their spacing above the segment's."""
    return min(point_distance(elevation_m, res_m, place) for place in places_m)


def height_range(elevation_m: F32, res_m: float, start_m: F64, end_m: F64) -> tuple[float, float]:
    """Smallest and largest height above the cells below, between all crossings of grid lines."""
    crossings = [0.0, 1.0]
    for axis, count in ((0, elevation_m.shape[1]), (1, elevation_m.shape[0])):
        crossings += [(k * res_m - start_m[axis]) / (end_m[axis] - start_m[axis]) for k in range(count + 1)]
    ts = np.unique(np.clip(crossings, 0.0, 1.0))
    lowest, highest = np.inf, -np.inf
    for t0, t1 in itertools.pairwise(ts):
        middle = start_m + (t0 + t1) / 2 * (end_m - start_m)
        heights = [
            _height_above(elevation_m, res_m, np.array([*middle[:2], z])) for z in _altitudes(start_m, end_m, t0, t1)
        ]
        lowest, highest = min(lowest, *heights), max(highest, *heights)
    return lowest, highest


def _altitudes(start_m: F64, end_m: F64, t0: float, t1: float) -> tuple[float, float]:
    return start_m[2] + t0 * (end_m[2] - start_m[2]), start_m[2] + t1 * (end_m[2] - start_m[2])


def _height_above(elevation_m: F32, res_m: float, point_m: F64) -> float:
    row, col = int(np.floor(point_m[1] / res_m)), int(np.floor(point_m[0] / res_m))
    if not (0 <= row < elevation_m.shape[0] and 0 <= col < elevation_m.shape[1]):
        return -np.inf
    ground_m = float(elevation_m[row, col])
    return float(point_m[2]) - ground_m if np.isfinite(ground_m) else -np.inf


def segment_distance(elevation_m: F32, res_m: float, start_m: F64, end_m: F64) -> float:
    """The segment's distance by ternary search over each column's convex distance function."""
    height_px, width_px = elevation_m.shape
    ends = [point_to_outside(p, width_px * res_m, height_px * res_m) for p in (start_m, end_m)]
    top = np.where(np.isfinite(elevation_m), elevation_m.astype(np.float64), np.inf)
    low, high = np.zeros(elevation_m.shape), np.ones(elevation_m.shape)
    for _ in range(90):
        third = (high - low) / 3.0
        left, right = low + third, high - third
        nearer = _distance_sq(top, res_m, start_m, end_m, left) < _distance_sq(top, res_m, start_m, end_m, right)
        high, low = np.where(nearer, right, high), np.where(nearer, low, left)
    return min(*ends, float(np.sqrt(_distance_sq(top, res_m, start_m, end_m, (low + high) / 2).min())))


def point_to_outside(point_m: F64, width_m: float, height_m: float) -> float:
    x, y = point_m[:2]
    return max(0.0, min(x, y, width_m - x, height_m - y))


def return_altitude(
    elevation_m: F32, res_m: float, place_m: F64, home_xy_m: F64, clearance_m: float, step_m: float
) -> float:
    """Altitude that a level flight from a place to home needs, from places every ``step_m``: never too much."""
    home_m = np.array([*home_xy_m, place_m[2]])
    needed = -np.inf
    top = np.where(np.isfinite(elevation_m), elevation_m.astype(np.float64), np.inf)
    for x, y, _ in sampled_segment(np.asarray(place_m), home_m, step_m):
        outside = point_to_outside(np.array([x, y]), elevation_m.shape[1] * res_m, elevation_m.shape[0] * res_m)
        if outside < clearance_m:
            return np.inf
        reach_sq = clearance_m**2 - _flat_distance_sq(elevation_m.shape, res_m, x, y)
        asked = np.where(reach_sq > 0.0, top + np.sqrt(np.maximum(reach_sq, 0.0)), -np.inf)
        needed = max(needed, float(asked.max()))
    return needed


def _flat_distance_sq(shape: tuple[int, ...], res_m: float, x: F64 | float, y: F64 | float) -> F64:
    west = np.arange(shape[1])[None, :] * res_m
    north = np.arange(shape[0])[:, None] * res_m
    dx = np.maximum(0.0, np.maximum(west - x, x - west - res_m))
    dy = np.maximum(0.0, np.maximum(north - y, y - north - res_m))
    return dx**2 + dy**2


def _distance_sq(top: F64, res_m: float, start_m: F64, end_m: F64, t: F64) -> F64:
    x, y, z = (start_m[k] + t * (end_m[k] - start_m[k]) for k in range(3))
    return _flat_distance_sq(top.shape, res_m, x, y) + np.maximum(0.0, z - top) ** 2
