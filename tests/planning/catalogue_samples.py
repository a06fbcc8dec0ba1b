"""Catalogues for tests: models in memory, STAC items, and the slow way to say what a place's surface must be."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

import numpy as np
from affine import Affine
from pyproj import CRS

from mapping.geometry.arrays import F32
from planning.terrain.catalogue.best import Layer, seam_m
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import CatalogueModel, Opened
from planning.terrain.dsm import Dsm
from planning.terrain.rasters.dsm_file import DsmFile
from planning.terrain.rasters.header import RasterLimits

WEST_M, NORTH_M = 500_000.0, 4_170_000.0


@dataclass(frozen=True, slots=True)
class Remembered(Dsm):
    """A model that stands in for one in a file."""

    def forget(self) -> None:
        """Keeps its heights: there is no file."""


def in_memory(
    heights: F32,
    *,
    cell_m: float = 5.0,
    east_m: float = 0.0,
    south_m: float = 0.0,
    rms_m: float = 0.1,
    told: bool = True,
    horizontal_m: float = 1.0,
    year: int | None = 2020,
    name: str = "a",
    place_m: float = 0.0,
) -> CatalogueModel:
    """A model whose north-west corner lies so far east and south of ``WEST_M``, ``NORTH_M``."""
    transform = Affine(cell_m, 0.0, WEST_M + east_m, 0.0, -cell_m, NORTH_M - south_m)
    file = Remembered(heights, transform, CRS.from_epsg(32633), None, f"of {name}", name=name)
    taken = None if year is None else datetime(year, 5, 1, tzinfo=UTC)
    return CatalogueModel(cast(DsmFile, file), name, taken, cell_m, rms_m, told, horizontal_m, place_m)


def item(folder: Path, raster: str, *, name: str = "", **properties: Any) -> Path:
    """A STAC item beside a raster; ``properties`` with "__" for ":"."""
    said = {key.replace("__", ":"): value for key, value in properties.items()}
    made = {
        "type": "Feature",
        "stac_version": "1.1.0",
        "id": name or Path(raster).stem,
        "geometry": None,
        "properties": said,
        "assets": {"dsm": {"href": f"./{raster}"}},
        "links": [],
    }
    path = folder / f"{Path(raster).stem}.json"
    path.write_text(json.dumps(made))
    return path


@dataclass(frozen=True, slots=True)
class Slow:
    """What of one square each model says, by looking at every cell."""

    high_m: list[float]
    """Highest known cell touched of each model; NaN: none."""
    low_m: list[float]
    best: int
    """-1: none."""


def slow_square(layers: tuple[Layer, ...], west: float, north: float, side: float) -> Slow:
    high, low, best = [], [], -1
    for number, layer in enumerate(layers):
        dsm = cast(Dsm, layer.model.file)
        known, whole = [], True
        cell, t = dsm.resolution_m, dsm.transform
        for row in range(dsm.height_px):
            for column in range(dsm.width_px):
                x, y = t.c + column * cell, t.f - row * cell
                if (
                    min(x + cell, west + side) - max(x, west) < 1e-4
                    or min(y, north) - max(y - cell, north - side) < 1e-4
                ):
                    continue
                value = float(dsm.elevation_m[row, column])
                whole &= math.isfinite(value)
                known += [value] if math.isfinite(value) else []
        west_m, south_m, east_m, north_m = dsm.bounds_m
        inside = west_m - 1e-4 <= west and west + side <= east_m + 1e-4
        inside &= south_m - 1e-4 <= north - side and north <= north_m + 1e-4
        high.append(max(known, default=math.nan))
        low.append(min(known, default=math.nan))
        if best < 0 and whole and inside:
            best = number
    return Slow(high, low, best)


def who_counts(
    layers: tuple[Layer, ...], transform: Affine, shape: tuple[int, int]
) -> dict[tuple[int, int], tuple[Slow, set[int]]]:
    """Of each square what the models say, and which of them count, by the rule as it is written down."""
    squares = {
        (row, column): slow_square(layers, *(transform @ (column, row)), transform.a)
        for row in range(shape[0])
        for column in range(shape[1])
    }
    found = dict[tuple[int, int], tuple[Slow, set[int]]]()
    for (row, column), here in squares.items():
        counting = {here.best} | {k for k in range(here.best) if math.isfinite(here.high_m[k])}
        for (r, c), there in squares.items():
            away_m = transform.a * math.hypot(max(0, abs(r - row) - 1), max(0, abs(c - column) - 1))
            if there.best <= here.best or not math.isfinite(here.high_m[there.best]):
                continue
            if away_m <= seam_m(layers[here.best].model, layers[there.best].model):
                counting.add(there.best)
        found[row, column] = here, counting if here.best >= 0 else set()
    return found


def worse_end(
    layers: tuple[Layer, ...], transform: Affine, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Highest, lowest and best of each square by the rule as it is written down, one square and one pair at a time."""
    highest, lowest = np.full(shape, np.nan), np.full(shape, np.nan)
    best = np.full(shape, -1)
    for place, (here, counting) in who_counts(layers, transform, shape).items():
        best[place] = here.best
        if counting:
            highest[place] = max(here.high_m[k] + layers[k].raise_m for k in counting)
            lowest[place] = min(here.low_m[k] - layers[k].drop_m for k in counting)
    return highest, lowest, best


def tower_beside(east_m: float, off_m: float) -> tuple[Catalogue, Dsm]:
    """A good model of 900 m by 900 m, in the midst of one of 2 km that is off in place; and the truth.

    The coarser shows a tower of 80 m at ``east_m`` of its corner and so far south of where it is.
    """
    side, cell_m, south_m = 400, 5.0, 1002.5
    shown, real = (np.zeros((side, side), np.float32) for _ in range(2))
    shown[int((south_m + off_m) // cell_m), int(east_m // cell_m)] = 80.0
    real[int(south_m // cell_m), int(east_m // cell_m)] = 80.0
    survey = in_memory(shown, cell_m=cell_m, year=2010, name="survey", place_m=off_m, horizontal_m=off_m)
    flat = np.zeros((180, 180), np.float32)
    flight = in_memory(flat, cell_m=cell_m, year=2024, name="flight", east_m=550.0, south_m=550.0)
    catalogue = Catalogue(Opened((flight, survey), (), ()), "c", RasterLimits())
    return catalogue, Dsm(real, catalogue.transform, catalogue.crs, None, "truth")
