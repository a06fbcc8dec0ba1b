"""Which models of a catalogue matter around some places: whose cells make the grid, and whose error in place counts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from affine import Affine

from planning.terrain.catalogue.best import SEAM_M, Layer, counting_in, farthest_seam_m, meeting
from planning.terrain.catalogue.models import CatalogueModel

Bounds = tuple[float, float, float, float]
"""(west, south, east, north), projected metres."""
_LOOKED_PX = 250_000
"""Squares in which is looked for who counts."""
_READ_PX = 32_000_000
"""Cells of the finest model that are read for it at once."""


def those_near(models: Sequence[CatalogueModel], bounds_m: Bounds) -> list[CatalogueModel]:
    """Those that decide anything within bounds: that reach into them, or so near that their seams do."""
    return meeting(models, wider(bounds_m, _reach_m(models, bounds_m)))


def place_near_m(
    layers: Sequence[Layer], grid: Affine, bounds_m: Bounds, progress: Callable[[float], None] = lambda share: None
) -> float:
    """The largest ``place_m`` of the models that count within bounds, or in what their seams reach from there.

    What is truly at a place is shown within the error of the model that is the best there, and that one counts there.
    It is looked at in squares of several cells of ``grid``, of which each holds whole ones: who counts in one of the
    grid's squares counts in the larger one around it, or in one that its seam reaches. Only there is looked where a
    model reaches that would make it larger: the search ends with the first square of the worst of all.
    """
    models = [layer.model for layer in layers]
    near = those_near(models, bounds_m)
    if len({model.place_m for model in near}) <= 1:
        return near[0].place_m if near else 0.0
    reach_m = _reach_m(models, bounds_m)
    coarse, parts = _parts(grid, wider(bounds_m, reach_m))
    around, found_m = math.ceil(reach_m / coarse.a) + 2, 0.0
    for number, (row, column, rows, columns) in enumerate(parts):
        progress(number / len(parts))
        part = coarse @ Affine.translation(column - around, row - around)
        shape = rows + 2 * around, columns + 2 * around
        (west, north), (east, south) = part @ (0, 0), part @ (shape[1], shape[0])
        if max((model.place_m for model in meeting(models, (west, south, east, north))), default=0.0) <= found_m:
            continue
        inner = slice(around, around + rows), slice(around, around + columns)
        found_m = max([found_m, *(models[k].place_m for k in counting_in(layers, part, shape, inner))])
    return found_m


def is_aligned(one: Affine, other: Affine) -> bool:
    """Whether two grids have the same cells."""
    column, row = ~one @ (other.c, other.f)
    apart_px = max(abs(column - round(column)), abs(row - round(row)))
    return math.isclose(one.a, other.a, rel_tol=1e-9) and apart_px < 1e-3


def _reach_m(models: Sequence[CatalogueModel], bounds_m: Bounds) -> float:
    return max(SEAM_M, farthest_seam_m(meeting(models, bounds_m)))


def _parts(grid: Affine, bounds_m: Bounds) -> tuple[Affine, list[tuple[int, int, int, int]]]:
    """A grid of squares of several cells each, and parts of it (first row, first column, rows, columns) over bounds."""
    west, south, east, north = bounds_m
    across_px = max(east - west, north - south) / grid.a
    together = max(2, math.ceil(across_px / math.sqrt(_LOOKED_PX)))
    coarse = grid @ Affine.scale(together)
    (column0, row0), (column1, row1) = ~coarse @ (west, north), ~coarse @ (east, south)
    at_once, rows, columns = max(1, math.isqrt(_READ_PX) // together), math.ceil(row1), math.ceil(column1)
    return coarse, [
        (row, column, min(at_once, rows - row), min(at_once, columns - column))
        for row in range(math.floor(row0), rows, at_once)
        for column in range(math.floor(column0), columns, at_once)
    ]


def wider(bounds_m: Bounds, by_m: float) -> Bounds:
    west, south, east, north = bounds_m
    return west - by_m, south - by_m, east + by_m, north + by_m
