"""A catalogue of surface models as one surface model: only the parts that are asked for are read and made.

Its own grid is the finest model's. A flight looks at it ``over`` its places: on the grid of the finest model around
them, whatever lies elsewhere. Any grid will do, no square is lower than what counts in it; plan, certificate and the
flight of a mission take the same one, for they ask with the places that it flies to and the same margin. What it says
of errors in place holds within that margin alone.
"""

from __future__ import annotations

import copy
import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from affine import Affine

from mapping.geometry.arrays import F64, Bools
from planning.errors import ParameterError
from planning.terrain.catalogue.best import (
    BYTES_PER_PX,
    NO_MODEL,
    SEAM_M,
    Layer,
    Surface,
    farthest_seam_m,
    layers_of,
    len_of,
    meeting,
    surface_of,
)
from planning.terrain.catalogue.listed_models import LeftOut, listing_of
from planning.terrain.catalogue.models import CatalogueModel, Opened, open_models
from planning.terrain.catalogue.nearby import Bounds, is_aligned, place_near_m, those_near, wider
from planning.terrain.dsm import FLIGHT_MARGIN_M, Dsm, SurfaceModel
from planning.terrain.rasters.dsm_file import AHEAD_PX
from planning.terrain.rasters.header import RasterLimits, check_pixels
from planning.terrain.rasters.memory_at_hand import check_memory, watched
from planning.terrain.rasters.reading import Declared, Progress

SURFACE_STAGE = "resample"
MOST_ASKED = 16
"""Places for which is remembered what lies around them."""


@dataclass(frozen=True, slots=True)
class Share:
    """How much of a part a model is the best for."""

    model: CatalogueModel
    share: float
    """Of the part's squares, those that no model knows included."""


@dataclass(frozen=True, slots=True)
class _Kept:
    rows: slice
    columns: slice
    surface: Surface

    def holds(self, rows: slice, columns: slice) -> bool:
        return all(
            mine.start <= other.start and other.stop <= mine.stop
            for mine, other in ((self.rows, rows), (self.columns, columns))
        )


class Catalogue(SurfaceModel):
    """On the grid of the finest model, or of the finest around some places; the last part that was made is kept."""

    def __init__(self, opened: Opened, name: str, limits: RasterLimits, progress: Progress | None = None) -> None:
        self.layers: tuple[Layer, ...] = layers_of(opened.models)
        self.left_out: tuple[LeftOut, ...] = opened.left_out
        self.name, self._limits, self._progress = name, limits, progress
        best = opened.models[0]
        self.crs, self.vertical_datum = best.file.crs, best.vertical_datum
        self._finest = min(opened.models, key=lambda model: model.file.resolution_m)
        self.transform, self._shape = _grid_over(opened.models, self._finest)
        self.rms_m = min((model.rms_m for model in opened.models if model.rms_told), default=None)
        self.place_m = self._most_place_m = max(model.place_m for model in opened.models)
        self.sha256 = _digest(self.layers, self.transform)
        self._notes = opened.notes
        self._kept: _Kept | None = None
        self._of: Catalogue = self
        self._looks: dict[tuple[str, float], Catalogue] = {}
        self._asked: dict[Bounds, Catalogue] = {}

    @property
    def most_place_m(self) -> float:
        return self._most_place_m

    @property
    def said_of_look(self) -> dict[str, object]:
        return {
            "models_place_error_m": self.place_m,
            "models_finest": f"{self._finest.name}, cells of {self.resolution_m:.3g} m",
        }

    @property
    def height_px(self) -> int:
        return self._shape[0]

    @property
    def width_px(self) -> int:
        return self._shape[1]

    @property
    def models(self) -> tuple[CatalogueModel, ...]:
        """The best first."""
        return tuple(layer.model for layer in self.layers)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was left out and why, and what is remarkable about the models, in plain words."""
        return (*(f"Left out: {out.name}: {out.why}" for out in self.left_out), *self._notes)

    def whole(self) -> Dsm:
        return self.window(0, 0, *self._shape)

    def over(self, xy_m: F64, margin_m: float = FLIGHT_MARGIN_M) -> Catalogue:
        """On the grid of the finest model around the places, with the largest horizontal error of those that count.

        Raises RasterTooLargeError where the box around the places has too many of its cells.
        """
        whole = self._of
        xy = whole._inside(xy_m)
        if not len(xy):
            return whole
        west, south, east, north = *(xy.min(axis=0) - margin_m), *(xy.max(axis=0) + margin_m)
        asked = float(west), float(south), float(east), float(north)
        if asked not in whole._asked:
            if len(whole._asked) >= MOST_ASKED:
                whole._asked.pop(next(iter(whole._asked)))
            whole._asked[asked] = whole._look(asked, np.ptp(xy, axis=0))
        found = whole._asked[asked]
        for other in {whole, *whole._looks.values()} - {found}:
            other._kept = None
        return found

    def around(self, xy_m: F64, margin_m: float) -> Dsm:
        model = self if self._of is not self else self.over(xy_m, max(margin_m, FLIGHT_MARGIN_M))
        return model.window(*model.box_around(xy_m, margin_m))

    def window(self, row0: int, col0: int, height_px: int, width_px: int) -> Dsm:
        rows = slice(max(0, row0), min(self.height_px, row0 + height_px))
        columns = slice(max(0, col0), min(self.width_px, col0 + width_px))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            raise ParameterError("The window lies outside the surface model.")
        found = self._surface(rows, columns)
        return Dsm(
            np.ascontiguousarray(found.elevation_m),
            self.transform @ Affine.translation(columns.start, rows.start),
            self.crs,
            self.vertical_datum,
            self.sha256,
            name=self.name,
            lowest_m=np.ascontiguousarray(found.lowest_m),
            seam=np.ascontiguousarray(found.seam),
            rms_m=self.rms_m,
            place_m=self.place_m,
        )

    def elevation_at(self, xy_m: F64) -> F64:
        xy = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
        inside, out = self._are_inside(xy), np.full(len(xy), np.nan)
        if inside.any():
            out[inside] = self.around(xy[inside], self.resolution_m).elevation_at(xy[inside])
        return out

    def shares_of(self, part: Dsm) -> tuple[list[Share], float]:
        """Which models are the best in a part of this model, and how much of it lies at a seam."""
        looks = (look for look in (self._of, *self._of._looks.values()) if is_aligned(look.transform, part.transform))
        model = max(looks, key=lambda look: look._kept is not None, default=self)
        corner = np.array([part.transform @ (0.5, 0.5)])
        row, column = (int(place[0]) for place in model.fractional_cell(corner))
        found = model._surface(slice(row, row + part.height_px), slice(column, column + part.width_px))
        counts = np.bincount(found.best.ravel(), minlength=NO_MODEL + 1)[: len(self.layers)]
        size = found.best.size
        shares = [Share(layer.model, count / size) for layer, count in zip(self.layers, counts, strict=True) if count]
        return shares, float(found.seam.mean())

    def _are_inside(self, xy_m: F64) -> Bools:
        west, south, east, north = self.bounds_m
        return np.all((xy_m >= (west, south)) & (xy_m <= (east, north)), axis=1)

    def _inside(self, xy_m: F64) -> F64:
        xy = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
        return xy[self._are_inside(xy)]

    def _look(self, bounds_m: Bounds, asked_m: F64) -> Catalogue:
        """Of this catalogue, within bounds: kept, so that what was made of it is not made again.

        ``asked_m``: (east, north) how long the box around the places is, without what lies around it.
        """
        near = those_near(self.models, bounds_m)
        if not near:
            return self
        finest = min(near, key=lambda model: model.file.resolution_m)
        grid = _grid_over(self.models, finest)
        columns, rows = (math.ceil(float(side_m) / finest.file.resolution_m) for side_m in asked_m)
        check_pixels(rows, columns, self._limits.max_px, where=self._where(finest))
        told = watched(self._progress, where=self.name)
        # One cell more: a part ends with the cell that the bounds lie in.
        place_m = place_near_m(
            self.layers, grid[0], wider(bounds_m, finest.file.resolution_m), lambda share: told(SURFACE_STAGE, share)
        )
        key = finest.file.sha256, place_m
        if key not in self._looks:
            look = copy.copy(self)
            look.transform, look._shape, look._finest = *grid, finest
            look.place_m, look._kept = place_m, None
            self._looks[key] = look
        return self._looks[key]

    def _surface(self, rows: slice, columns: slice) -> Surface:
        if self._kept is None or not self._kept.holds(rows, columns):
            self._kept = None
            self._kept = self._made(_wider(rows, AHEAD_PX, self.height_px), _wider(columns, AHEAD_PX, self.width_px))
        kept = self._kept
        return kept.surface.part(_within(rows, kept.rows), _within(columns, kept.columns))

    def _made(self, rows: slice, columns: slice) -> _Kept:
        """With as much around it as seams reach: what is made of a place is the same in every part."""
        reach = math.ceil(farthest_seam_m(meeting(self.models, self._bounds_of(rows, columns))) / self.resolution_m) + 2
        around = _wider(rows, reach, self.height_px), _wider(columns, reach, self.width_px)
        shape = len_of(around[0]), len_of(around[1])
        check_pixels(*shape, self._limits.max_px, where=self._where(self._finest))
        check_memory(BYTES_PER_PX * shape[0] * shape[1], shape=shape, where=self.name)
        told = watched(self._progress, where=self.name)
        made = surface_of(
            self.layers,
            self.transform @ Affine.translation(around[1].start, around[0].start),
            shape,
            progress=lambda share: told(SURFACE_STAGE, share),
        )
        return _Kept(rows, columns, made.part(_within(rows, around[0]), _within(columns, around[1])))

    def _where(self, finest: CatalogueModel) -> str:
        cell_m = finest.file.resolution_m
        return f"{self.name}, at the cells of {finest.name}, the finest model here ({cell_m:.3g} m)"

    def _bounds_of(self, rows: slice, columns: slice) -> Bounds:
        """One square more on each side: what only touches the part is in."""
        west, north = self.transform @ (columns.start - 1, rows.start - 1)
        east, south = self.transform @ (columns.stop + 1, rows.stop + 1)
        return west, south, east, north


def open_catalogue(source: Path, declared: Declared, progress: Progress | None = None) -> Catalogue:
    """Of a folder of GeoTIFFs, or a STAC document. RasterError where no surface model of it can be used."""
    name = source.resolve().name
    opened = open_models(listing_of(source), declared, progress)
    return Catalogue(opened, name, declared.limits, progress)


def _grid_over(models: tuple[CatalogueModel, ...], finest: CatalogueModel) -> tuple[Affine, tuple[int, int]]:
    """Transform and (rows, columns) of one model's grid, drawn out over all of them."""
    cell_m, own = finest.file.resolution_m, finest.file.transform
    west, south, east, north = (
        choose(model.file.bounds_m[side] for model in models) for side, choose in enumerate((min, min, max, max))
    )
    row0, column0 = math.floor((own.f - north) / cell_m + 1e-6), math.floor((west - own.c) / cell_m + 1e-6)
    row1, column1 = math.ceil((own.f - south) / cell_m - 1e-6), math.ceil((east - own.c) / cell_m - 1e-6)
    # Over floors and ceilings the grid misses no more than a millionth of a cell, which no square touches.
    return own @ Affine.translation(column0, row0), (row1 - row0, column1 - column0)


def _digest(layers: tuple[Layer, ...], transform: Affine) -> str:
    """SHA-256 of all that decides the surface: the files' own, their order, and what their heights are changed by."""
    own = [
        (layer.model.file.sha256, layer.raise_m, layer.drop_m, layer.model.horizontal_m, layer.model.rms_told)
        for layer in layers
    ]
    return hashlib.sha256(json.dumps([own, tuple(transform)[:6], SEAM_M]).encode()).hexdigest()


def _wider(part: slice, around: int, count: int) -> slice:
    return slice(max(0, part.start - around), min(count, part.stop + around))


def _within(part: slice, outer: slice) -> slice:
    return slice(part.start - outer.start, part.stop - outer.start)
