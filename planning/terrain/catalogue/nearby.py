"""Which models of a catalogue matter around some places: whose cells make the grid, and whose error in place counts."""

from __future__ import annotations

import math
from collections.abc import Sequence

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
    return meeting(models, _wider(bounds_m, _reach_m(models, bounds_m)))


def place_near_m(layers: Sequence[Layer], near: Sequence[CatalogueModel], grid: Affine, bounds_m: Bounds) -> float:
    """The largest ``place_m`` of the models that count within bounds, or in what their seams reach from there.

    What is truly at a place is shown within the error of the model that is the best there, and that one counts there.
    It is looked at in squares of several cells of ``grid``, of which each holds whole ones: who counts in one of the
    grid's squares counts in the larger one around it, or in one that its seam reaches.
    """
    errors_m = sorted({model.place_m for model in near}, reverse=True)
    if len(errors_m) == 1:
        return errors_m[0]
    if not errors_m:
        return 0.0
    reach_m = _reach_m([layer.model for layer in layers], bounds_m)
    counting = _counting(layers, grid, _wider(bounds_m, reach_m), reach_m)
    return max((layers[number].model.place_m for number in counting), default=0.0)


def is_aligned(one: Affine, other: Affine) -> bool:
    """Whether two grids have the same cells."""
    column, row = ~one @ (other.c, other.f)
    apart_px = max(abs(column - round(column)), abs(row - round(row)))
    return math.isclose(one.a, other.a, rel_tol=1e-9) and apart_px < 1e-3


def _reach_m(models: Sequence[CatalogueModel], bounds_m: Bounds) -> float:
    return max(SEAM_M, farthest_seam_m(meeting(models, bounds_m)))


def _counting(layers: Sequence[Layer], grid: Affine, bounds_m: Bounds, reach_m: float) -> set[int]:
    west, south, east, north = bounds_m
    across_px = max(east - west, north - south) / grid.a
    together = max(2, math.ceil(across_px / math.sqrt(_LOOKED_PX)))
    coarse = grid @ Affine.scale(together)
    (column0, row0), (column1, row1) = ~coarse @ (west, north), ~coarse @ (east, south)
    around = math.ceil(reach_m / coarse.a) + 2
    at_once = max(1, math.isqrt(_READ_PX) // together)
    found = set[int]()
    for row in range(math.floor(row0), math.ceil(row1), at_once):
        for column in range(math.floor(column0), math.ceil(column1), at_once):
            rows, columns = (min(at_once, math.ceil(row1) - row), min(at_once, math.ceil(column1) - column))
            part = coarse @ Affine.translation(column - around, row - around)
            shape = rows + 2 * around, columns + 2 * around
            found |= counting_in(layers, part, shape, (slice(around, around + rows), slice(around, around + columns)))
    return found


def _wider(bounds_m: Bounds, by_m: float) -> Bounds:
    west, south, east, north = bounds_m
    return west - by_m, south - by_m, east + by_m, north + by_m
