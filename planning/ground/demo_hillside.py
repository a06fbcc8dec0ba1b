"""A generated surface model to try Hedgehop on: a volcano's flank with lava, a ruin, trees and a mast.

Not real: the place is near Mount Etna, the heights are invented. The same seed gives the same model.
"""

from __future__ import annotations

import hashlib

import numpy as np
from affine import Affine
from pyproj import CRS, Transformer
from scipy import ndimage

from mapping.geometry.arrays import F64
from planning.basics.plan_model import Poi
from planning.terrain.dsm import Dsm

_HILL_PX = 120
_SIZE_PX = 1000
_RESOLUTION_M = 0.5
_WEST_M, _SOUTH_M = 499_200.0, 4_175_600.0
_EPSG = 32633
_DATUM = "EGM2008 height"
_HOME_ALT_M = 1712.0

# Metres east and north of the model's south-west corner.
_RUIN = (228.0, 196.0)
_MAST = (292.0, 318.0)
_SMALL_HOLE = (262.0, 214.0)
_EDGE_PATCH = (492.0, 408.0)
_POIS = (
    ("Meadow", 150.0, 150.0, 0.0),
    ("Ruin", 212.0, 186.0, 5.0),
    ("Gully", 284.0, 204.0, 0.0),
    ("Lava levee", 338.0, 262.0, 0.0),
    ("Mast", 300.0, 326.0, 5.0),
    ("Old channel", 207.0, 312.0, 0.0),
)
_SURVEY = ((120.0, 130.0), (250.0, 140.0), (262.0, 232.0), (140.0, 240.0))


def demo_dsm(seed: int = 7) -> Dsm:
    """The scene: 1000 x 1000 cells of 0.5 m, UTM zone 33N, heights above the EGM2008 geoid."""
    random = np.random.default_rng(seed)
    metres = (np.arange(_SIZE_PX) + 0.5) * _RESOLUTION_M
    east: F64 = np.tile(metres, (_SIZE_PX, 1)).astype(np.float64)
    north: F64 = np.tile(metres[::-1, None], (1, _SIZE_PX)).astype(np.float64)
    surface = _hillside(east, north, random)
    surface += _lava(east, north, random) + _gullies(east, north)
    _build_ruin(surface, east, north, random)
    _plant_trees(surface, east, north, random)
    _raise_mast(surface)
    _cut_unknown(surface, east, north)
    elevation = np.round(surface, 3).astype(np.float32)
    transform = Affine(_RESOLUTION_M, 0.0, _WEST_M, 0.0, -_RESOLUTION_M, _SOUTH_M + _SIZE_PX * _RESOLUTION_M)
    return Dsm(elevation, transform, CRS.from_epsg(_EPSG), _DATUM, hashlib.sha256(elevation.tobytes()).hexdigest())


def small_hill() -> Dsm:
    """A cone of 120 x 120 m: the least that every kernel can be tried on."""
    cells = np.arange(_HILL_PX) - _HILL_PX / 2
    cone = 10.0 - np.hypot(cells[:, None], cells[None, :]) / 20.0
    transform = Affine(1.0, 0.0, _WEST_M, 0.0, -1.0, _SOUTH_M + _HILL_PX)
    return Dsm(cone.astype(np.float32), transform, CRS.from_epsg(_EPSG), None, "0" * 64)


def demo_pois() -> tuple[Poi, ...]:
    """A route over the scene, about 400 m long."""
    places = _lat_lon([(east, north) for _, east, north, _ in _POIS])
    return tuple(
        Poi(float(lat), float(lon), name, loiter_s)
        for (lat, lon), (name, _, _, loiter_s) in zip(places, _POIS, strict=True)
    )


def demo_survey_polygon() -> F64:
    """(4, 2) WGS84 latitude, longitude in degrees around meadow and ruin."""
    return _lat_lon(list(_SURVEY))


def _lat_lon(east_north_m: list[tuple[float, float]]) -> F64:
    xy = np.array(east_north_m) + np.array([_WEST_M, _SOUTH_M])
    wgs84 = Transformer.from_crs(CRS.from_epsg(_EPSG), CRS.from_epsg(4326), always_xy=True)
    lon, lat = wgs84.transform(xy[:, 0], xy[:, 1])
    return np.column_stack([lat, lon])


def _noise(random: np.random.Generator, wavelength_m: float) -> F64:
    """Smooth noise of unit variance."""
    field = ndimage.gaussian_filter(
        random.standard_normal((_SIZE_PX, _SIZE_PX)), wavelength_m / (4 * _RESOLUTION_M), mode="wrap"
    )
    return field / field.std()


def _hillside(east: F64, north: F64, random: np.random.Generator) -> F64:
    """A flank that steepens uphill, to the north, with rolling ground on it."""
    climb = 0.075 * (north - 150.0) + 0.00012 * (north - 150.0) * np.abs(north - 150.0)
    fall = -0.02 * (east - 150.0)
    rolling = 1.5 * _noise(random, 120.0) + 0.45 * _noise(random, 40.0) + 0.12 * _noise(random, 12.0)
    # Level ground to take off from.
    calm = 1.0 - np.exp(-((east - 150.0) ** 2 + (north - 150.0) ** 2) / (2 * 22.0**2))
    return _HOME_ALT_M + climb + fall + rolling * calm


def _lava(east: F64, north: F64, random: np.random.Generator) -> F64:
    """Two old flows: a channel between levees, with a rough, broken crust that thins out downhill."""
    crust = 0.9 * np.abs(_noise(random, 7.0)) + 0.5 * np.abs(_noise(random, 2.5))
    lava = np.zeros_like(east)
    for middle, sway, half_width, height, tip in ((352.0, 16.0, 21.0, 6.5, 120.0), (198.0, 12.0, 15.0, 4.5, 262.0)):
        axis = middle + sway * np.sin(north / 47.0 + middle) + 0.10 * (north - 250.0)
        across = np.abs(east - axis) / half_width
        levees = np.exp(-(((across - 0.8) / 0.28) ** 2))
        body = 1.0 / (1.0 + np.exp((across - 1.05) / 0.09))
        reached = 1.0 / (1.0 + np.exp((tip - north) / 9.0))
        lava += reached * (height * levees + body * (0.35 * height + crust))
    return lava


def _gullies(east: F64, north: F64) -> F64:
    """Two water-cut gullies, wider and deeper downhill."""
    cut = np.zeros_like(east)
    for middle, depth, width, sway in ((281.0, 7.0, 8.0, 11.0), (96.0, 5.0, 6.0, 8.0)):
        axis = middle + sway * np.sin(north / 38.0 + depth) + 0.05 * (north - 250.0)
        grown = np.clip(1.15 - north / 520.0, 0.15, 1.0)
        cut -= depth * grown * np.exp(-(np.abs((east - axis) / (width * (0.7 + 0.6 * grown))) ** 1.6))
    return cut


def _build_ruin(surface: F64, east: F64, north: F64, random: np.random.Generator) -> None:
    """A roofless house: broken walls 0.8 m thick, a door, a gable that still stands, rubble."""
    angle = np.deg2rad(24.0)
    u = (east - _RUIN[0]) * np.cos(angle) + (north - _RUIN[1]) * np.sin(angle)
    v = -(east - _RUIN[0]) * np.sin(angle) + (north - _RUIN[1]) * np.cos(angle)
    inside = (np.abs(u) <= 8.0) & (np.abs(v) <= 5.0)
    floor = float(np.median(surface[inside]))
    surface[inside] = floor + 0.35 * np.abs(random.standard_normal(int(inside.sum())))
    outer = (np.abs(u) > 7.2) | (np.abs(v) > 4.2) | (np.abs(u - 2.0) < 0.4)
    door = (v < 0) & (np.abs(u + 3.0) < 0.9)
    broken = 3.2 + 0.9 * np.sin(1.3 * u + 0.7) + 0.7 * np.sin(2.9 * v)
    gable = np.where(u < -7.2, 3.4 * (1.0 - np.abs(v) / 5.0), 0.0)
    walls = inside & outer & ~door
    surface[walls] = floor + np.round(broken + gable, 1)[walls]


def _plant_trees(surface: F64, east: F64, north: F64, random: np.random.Generator) -> None:
    """Oaks and pines in loose groups, none on the take-off meadow or the mast."""
    groups = ((178.0, 228.0, 12), (252.0, 160.0, 11), (128.0, 320.0, 17), (410.0, 180.0, 19), (268.0, 268.0, 9))
    texture = 0.35 * _noise(random, 1.6)
    for group_east, group_north, count in groups:
        for _ in range(count):
            x, y = random.normal((group_east, group_north), 13.0)
            crown, height = random.uniform(1.6, 4.2), random.uniform(4.5, 10.5)
            near_mast = np.hypot(x - _MAST[0], y - _MAST[1]) < 12.0
            if np.hypot(x - 150.0, y - 150.0) < 30.0 or np.hypot(x - _RUIN[0], y - _RUIN[1]) < 15.0 or near_mast:
                continue
            _plant(surface, east, north, texture, (x, y, crown, height))


def _plant(surface: F64, east: F64, north: F64, texture: F64, tree: tuple[float, float, float, float]) -> None:
    x, y, crown, height = tree
    rows, columns = _around(x, y, crown)
    distance = np.hypot(east[rows, columns] - x, north[rows, columns] - y) / crown
    ground = surface[rows, columns]
    top = ground.min() + height * (0.45 + 0.55 * np.sqrt(np.clip(1.0 - distance**2, 0.0, 1.0))) + texture[rows, columns]
    surface[rows, columns] = np.where(distance < 1.0, np.maximum(ground, top), ground)


def _raise_mast(surface: F64) -> None:
    """One cell, 18 m high: what any careless thinning of the model would lose."""
    row, column = _cell(*_MAST)
    surface[row, column] += 18.0


def _cut_unknown(surface: F64, east: F64, north: F64) -> None:
    """A hole of 1.5 m2, small enough to be filled, and a patch at the edge that stays unknown."""
    row, column = _cell(*_SMALL_HOLE)
    surface[row : row + 2, column : column + 3] = np.nan
    x, y = east - _EDGE_PATCH[0], north - _EDGE_PATCH[1]
    direction = np.arctan2(y, x)
    surface[np.hypot(x, 0.75 * y) < 34.0 + 5.0 * np.sin(3 * direction) + 2.5 * np.sin(7 * direction + 1.0)] = np.nan


def _cell(east_m: float, north_m: float) -> tuple[int, int]:
    return _SIZE_PX - 1 - int(north_m / _RESOLUTION_M), int(east_m / _RESOLUTION_M)


def _around(east_m: float, north_m: float, reach_m: float) -> tuple[slice, slice]:
    row, column = _cell(east_m, north_m)
    reach = int(reach_m / _RESOLUTION_M) + 2
    return slice(max(0, row - reach), max(0, row + reach + 1)), slice(
        max(0, column - reach), max(0, column + reach + 1)
    )
