"""The surface of several models on one grid: the best at each place, where it ends the worse of both.

At each square the best model is the first that knows all that the square touches. Its highest cell counts, raised by
as much as its error is larger than the smallest of all. Where another model is the best within the reach of a seam,
that one counts too, and the higher of both is taken: objects at the edge of a model may be missing in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from affine import Affine
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from mapping.geometry.arrays import F32, Bools
from planning.terrain.catalogue.models import CatalogueModel
from planning.terrain.cells.squares import Touched, touched_cells
from planning.terrain.dsm import Dsm

SEAM_M = 20.0
"""Around a seam, beside cells and horizontal errors: the ball's usual radius."""
NO_MODEL = 255
BYTES_PER_PX = 40
"""While a surface is made: two grids that stay, those of one model, and masks."""


@dataclass(frozen=True, slots=True)
class Layer:
    """One model, with what its heights are changed by."""

    model: CatalogueModel
    raise_m: float
    """By as much its error is larger than the smallest of all."""
    drop_m: float
    """By as much a vehicle may stand lower on it than it says."""


@dataclass(frozen=True, slots=True)
class Surface:
    """(rows, columns) of a part of the grid."""

    elevation_m: F32
    """NaN where no model knows all."""
    lowest_m: F32
    """How low a vehicle may stand."""
    best: np.ndarray
    """uint8: which layer is the best; ``NO_MODEL`` where none is."""
    seam: Bools
    """Where more than one model counts, or another one begins near: steps between them are in none of them."""

    def part(self, rows: slice, columns: slice) -> Surface:
        cut = (rows, columns)
        return Surface(self.elevation_m[cut], self.lowest_m[cut], self.best[cut], self.seam[cut])


def layers_of(models: Sequence[CatalogueModel]) -> tuple[Layer, ...]:
    """A vehicle that stands on one model and flies over another has both errors, so that of where it stands counts.

    Where nothing is told of any error only the differences count: what is left is the clearance's own term.
    """
    least_m = min(model.bound_m for model in models)
    apart = len(models) > 1 and any(model.rms_told for model in models)
    return tuple(Layer(model, model.bound_m - least_m, model.bound_m - (0.0 if apart else least_m)) for model in models)


def seam_m(one: CatalogueModel, other: CatalogueModel) -> float:
    """How far from a place where another model is the best both count."""
    cells_m = math.sqrt(2.0) * (one.file.resolution_m + other.file.resolution_m)
    return SEAM_M + cells_m + one.horizontal_m + other.horizontal_m


def farthest_seam_m(models: Sequence[CatalogueModel]) -> float:
    return max((seam_m(one, other) for one in models for other in models if one is not other), default=0.0)


def surface_of(
    layers: Sequence[Layer],
    transform: Affine,
    shape: tuple[int, int],
    *,
    progress: Callable[[float], None] = lambda share: None,
) -> Surface:
    """Of (rows, columns) squares of a north-up grid; what lies outside of it is not looked at."""
    high_m, low_m = np.full(shape, -np.inf, np.float32), np.full(shape, np.inf, np.float32)
    best, seam = np.full(shape, NO_MODEL, np.uint8), np.zeros(shape, np.bool_)
    for number, layer in enumerate(layers):
        progress(number / len(layers))
        if not (best == NO_MODEL).any():
            break
        found = _touched(layer.model, transform, shape)
        layer.model.file.forget()
        if found is None:
            continue
        rows, columns, touched = found
        here = best[rows, columns]
        here[touched.whole & (here == NO_MODEL)] = number
        counts = _counting(layers, number, best, transform.a)[rows, columns] | (best[rows, columns] == number)
        counts |= ~touched.whole & (here > number)  # an edge: what of it is known stands there all the same
        counts &= ~np.isnan(touched.high_m)
        seam[rows, columns] |= counts & (here != number)
        np.fmax(
            high_m[rows, columns], touched.high_m + np.float32(layer.raise_m), out=high_m[rows, columns], where=counts
        )
        np.fmin(low_m[rows, columns], touched.low_m - np.float32(layer.drop_m), out=low_m[rows, columns], where=counts)
    unknown = best == NO_MODEL
    high_m[unknown] = low_m[unknown] = np.nan
    return Surface(high_m, low_m, best, (seam | _near_another(best, transform.a)) & ~unknown)


def _counting(layers: Sequence[Layer], number: int, best: np.ndarray, cell_m: float) -> Bools:
    """Where a better model is the best, and this one is within the reach of their seam."""
    mine, counts = best == number, np.zeros(best.shape, np.bool_)
    if not mine.any():
        return counts
    for better in np.unique(best[best < number]).tolist():
        px = math.ceil(seam_m(layers[number].model, layers[better].model) / cell_m) + 1
        counts |= (best == better) & (_grown(mine, px) > 0)
    return counts


def _near_another(best: np.ndarray, cell_m: float) -> Bools:
    """Where two models are the best within ``SEAM_M``, whether or not they overlap."""
    px = math.ceil(SEAM_M / cell_m) + 1
    last, first = _grown(np.where(best == NO_MODEL, np.uint8(0), best), px), best
    for axis in (0, 1):
        first = minimum_filter1d(first, _width(px, best.shape[axis]), axis=axis, mode="constant", cval=NO_MODEL)
    return last > first


def _grown(values: np.ndarray, px: int) -> np.ndarray:
    """The largest within a square of so many cells around: it holds the disc."""
    grown = values.astype(np.uint8)
    for axis in (0, 1):
        grown = maximum_filter1d(grown, _width(px, values.shape[axis]), axis=axis, mode="constant", cval=0)
    return grown


def _width(px: int, count: int) -> int:
    return min(2 * px + 1, 2 * count + 1)


def _touched(model: CatalogueModel, transform: Affine, shape: tuple[int, int]) -> tuple[slice, slice, Touched] | None:
    """Rows and columns of the grid that a model reaches into, and what they touch of it; None: none."""
    file, cell_m = model.file, transform.a
    west, south, east, north = file.bounds_m
    row0, row1 = _clipped((transform.f - north) / cell_m, (transform.f - south) / cell_m, shape[0])
    column0, column1 = _clipped((west - transform.c) / cell_m, (east - transform.c) / cell_m, shape[1])
    if row0 >= row1 or column0 >= column1:
        return None
    corner = transform @ Affine.translation(column0, row0)
    cells = _around(file.window, file.transform, corner, (row1 - row0, column1 - column0)).cells
    touched = touched_cells(cells, corner, (row1 - row0, column1 - column0))
    return slice(row0, row1), slice(column0, column1), touched


def _around(window: Callable[[int, int, int, int], Dsm], own: Affine, corner: Affine, shape: tuple[int, int]) -> Dsm:
    """The model's own part around some squares, two cells more on each side."""
    scale = corner.a / own.a
    top, left = (own.f - corner.f) / own.a, (corner.c - own.c) / own.a
    row0, column0 = math.floor(top) - 2, math.floor(left) - 2
    row1, column1 = math.ceil(top + shape[0] * scale) + 2, math.ceil(left + shape[1] * scale) + 2
    first_row, first_column = max(0, row0), max(0, column0)
    return window(first_row, first_column, row1 - first_row, column1 - first_column)


def _clipped(first: float, last: float, count: int) -> tuple[int, int]:
    return max(0, math.floor(first - 1e-6)), min(count, math.ceil(last + 1e-6))
