"""Ground for a flight whose surface model nobody has: level at home's height, with a grid to measure by."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from affine import Affine

from mapping.geometry.arrays import F64, U8
from planning.basics.plan_model import Home, Mission
from planning.following.reference import level_model
from planning.terrain.dsm import Dsm
from server.scene.geometry.payload import HeightGrid, TerrainScene

_MARGIN_M, _REACH_M = 60.0, 400.0
_CELLS, _TEXTURE_PX, _LINES_MAX = 60, 1600, 80
_GROUND, _LINE, _TENTH_LINE = (58, 64, 74), (92, 100, 114), (140, 150, 166)


def plain_ground(like: Dsm, points_m: F64) -> Dsm:
    """The level stand-in ``like``, drawn out under all of (N, 3) x, y, alt_dsm and its own middle."""
    west, south, east, north = like.bounds_m
    xy_m = np.vstack([points_m[:, :2], [[(west + east) / 2, (south + north) / 2]]])
    low, high = xy_m.min(axis=0) - _MARGIN_M, xy_m.max(axis=0) + _MARGIN_M
    cell_m = float((high - low).max()) / _CELLS
    columns, rows = (int(count) for count in np.ceil((high - low) / cell_m))
    level = np.full((rows, columns), like.elevation_m[0, 0], dtype=np.float32)
    transform = Affine(cell_m, 0.0, low[0], 0.0, -cell_m, high[1])
    return replace(like.as_grid(), elevation_m=level, transform=transform)


def plain_around(lat_deg: float, lon_deg: float) -> Dsm:
    """For a vehicle that flies from there; heights count from home."""
    level = level_model(Mission(Home(lat_deg, lon_deg, math.nan), ()))
    return plain_ground(level, np.array([[-_REACH_M, -_REACH_M, 0.0], [_REACH_M, _REACH_M, 0.0]]))


def plain_scene(ground: Dsm) -> TerrainScene:
    """With lines every 10, 100 or 1000 m from home, each tenth one stronger."""
    west, _, _, north = ground.bounds_m
    level_m = float(ground.elevation_m[0, 0])
    grid = HeightGrid(np.array(ground.elevation_m), west, north, ground.resolution_m)
    return TerrainScene("", grid, _lines(ground), level_m, level_m)


def _lines(ground: Dsm) -> U8:
    west, _, _, north = ground.bounds_m
    size_m = max(ground.elevation_m.shape) * ground.resolution_m
    step_m = next((step for step in (10.0, 100.0, 1000.0) if size_m / step <= _LINES_MAX), 10_000.0)
    px_m = size_m / _TEXTURE_PX
    rows, columns = (max(1, round(count * ground.resolution_m / px_m)) for count in ground.elevation_m.shape)
    x_m, y_m = west + (np.arange(columns) + 0.5) * px_m, north - (np.arange(rows) + 0.5) * px_m
    texture = np.broadcast_to(np.array(_GROUND, dtype=np.uint8), (rows, columns, 3)).copy()
    for every_m, color, width in ((step_m, _LINE, 1.0), (10 * step_m, _TENTH_LINE, 1.6)):
        texture[_near_line(y_m, every_m, width * px_m)] = color
        texture[:, _near_line(x_m, every_m, width * px_m)] = color
    return texture


def _near_line(at_m: F64, every_m: float, within_m: float) -> np.ndarray:
    return np.abs(at_m - every_m * np.round(at_m / every_m)) <= within_m
