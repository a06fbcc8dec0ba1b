"""Which directions the simulated radar's rays go in: an even grid, and closer ones over every shape."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, I32
from telemetry.simulation.simulator.scene.primitives import BOX
from telemetry.simulation.simulator.scene.ray_bundle import GROUND
from telemetry.simulation.simulator.sensors.radar_model import RadarModel

_LEAST_AZIMUTH, _LEAST_ELEVATION = 4, 8
"""Rays on each shape, however small it looks."""
_TILT_RAD = 0.6
"""How far the body may lean before shapes at the edge of the view get fewer rays."""


@dataclass(frozen=True, slots=True)
class Rays:
    direction_enu: F64
    """(N, 3) unit vectors"""
    solid_angle: F64
    """(N,) that each stands for"""
    wanted: I32
    """(N,) the primitive that it is sent to, or GROUND: what else it meets has rays of its own"""


def unit(azimuth_rad: F64, elevation_rad: F64) -> F64:
    """(N, 3) x right or east, y forward or north, z up; azimuth clockwise from y."""
    flat = np.cos(elevation_rad)
    return np.column_stack([np.sin(azimuth_rad) * flat, np.cos(azimuth_rad) * flat, np.sin(elevation_rad)])


def rays(
    model: RadarModel, rows: F64, numbers: I32, position_enu: F64, body_enu: F64, random: np.random.Generator
) -> Rays:
    """Those over the field of view and those over each of ``rows``, the primitives ``numbers``."""
    grid, grid_angle = _grid(model, random)
    heading_rad = math.atan2(body_enu[0, 1], body_enu[1, 1])
    window, cells = np.empty((len(rows), 4)), np.empty((len(rows), 2), np.int64)
    limits = np.array(
        [model.half_width_rad, model.lowest_rad - _TILT_RAD, model.highest_rad + _TILT_RAD, model.ray_step_rad]
    )
    _windows(rows, position_enu, heading_rad, limits, window, cells)
    count = int(cells.prod(axis=1).sum())
    direction, angle, wanted = np.empty((count, 3)), np.empty(count), np.empty(count, np.int32)
    _fill(window, cells, numbers, heading_rad, random.random((count, 2)), direction, angle, wanted)
    return Rays(
        np.concatenate([grid @ body_enu.T, direction]),
        np.concatenate([grid_angle, angle]),
        np.concatenate([np.full(len(grid), GROUND, np.int32), wanted]),
    )


def _grid(model: RadarModel, random: np.random.Generator) -> tuple[F64, F64]:
    """(N, 3) rays in the body's frame, anywhere in their cell of azimuth and elevation, and their solid angles."""
    width, height = 2 * model.half_width_rad, model.highest_rad - model.lowest_rad
    columns, rows = round(width / model.ray_step_rad), round(height / model.ray_step_rad)
    shake = random.random((2, rows, columns))
    azimuth = (np.arange(columns)[None, :] + shake[0]) / columns * width - model.half_width_rad
    elevation = ((np.arange(rows)[:, None] + shake[1]) / rows * height + model.lowest_rad).ravel()
    return unit(azimuth.ravel(), elevation), np.cos(elevation) * (width / columns) * (height / rows)


@njit(cache=True, nogil=True)
def _remainder(angle):
    return angle - 2 * math.pi * round(angle / (2 * math.pi))


@njit(cache=True, nogil=True)
def _windows(rows, position, heading, limits, window, cells):
    """(left, right, low, high) of the directions in which each primitive may be seen, right of the heading and above
    the horizon, and how many rays go there across and upwards."""
    half_width, lowest, highest, step = limits[0], limits[1], limits[2], limits[3]
    for k in range(rows.shape[0]):
        row = rows[k]
        x, y, z = row[1] - position[0], row[2] - position[1], position[2]
        away = math.hypot(x, y)
        reach, nearest = row[5], max(0.0, away - row[5])
        cos, sin = row[7], row[8]
        if row[0] == BOX:
            reach = math.hypot(row[5], row[6])
            out_x = max(0.0, abs(x * cos - y * sin) - row[5])
            out_y = max(0.0, abs(x * sin + y * cos) - row[6])
            nearest = math.hypot(out_x, out_y)
        above, below = row[4] - z, row[3] - z
        high = min(highest, math.atan2(above, nearest if above > 0.0 else away + reach))
        low = max(lowest, math.atan2(below, nearest if below < 0.0 else away + reach))
        left, right = -math.pi, math.pi
        if nearest > 0.0:
            middle = _remainder(math.atan2(x, y) - heading)
            left, right = middle, middle
            if row[0] == BOX:
                for u in (-1.0, 1.0):
                    for v in (-1.0, 1.0):
                        east = x + u * row[5] * cos + v * row[6] * sin
                        north = y - u * row[5] * sin + v * row[6] * cos
                        side = middle + _remainder(math.atan2(east, north) - heading - middle)
                        left, right = min(left, side), max(right, side)
            else:
                half = math.asin(min(1.0, reach / away))
                left, right = middle - half, middle + half
        left, right = max(left, -half_width), min(right, half_width)
        window[k, 0], window[k, 1], window[k, 2], window[k, 3] = left, right, low, high
        seen = left < right and low < high
        cells[k, 0] = max(_LEAST_AZIMUTH, math.ceil((right - left) / step)) if seen else 0
        cells[k, 1] = max(_LEAST_ELEVATION, math.ceil((high - low) / step)) if seen else 0


@njit(cache=True, nogil=True)
def _fill(window, cells, numbers, heading, shake, direction, angle, wanted):
    """One ray per cell of each window, anywhere in it."""
    n = 0
    for k in range(window.shape[0]):
        if cells[k, 0] == 0:
            continue
        across = (window[k, 1] - window[k, 0]) / cells[k, 0]
        upwards = (window[k, 3] - window[k, 2]) / cells[k, 1]
        for i in range(cells[k, 1]):
            for j in range(cells[k, 0]):
                azimuth = heading + window[k, 0] + (j + shake[n, 0]) * across
                elevation = window[k, 2] + (i + shake[n, 1]) * upwards
                flat = math.cos(elevation)
                direction[n, 0] = math.sin(azimuth) * flat
                direction[n, 1] = math.cos(azimuth) * flat
                direction[n, 2] = math.sin(elevation)
                angle[n], wanted[n] = flat * across * upwards, numbers[k]
                n += 1
