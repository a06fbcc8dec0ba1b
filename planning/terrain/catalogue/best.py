"""The surface of several models on one grid: the best at each place, where it ends the worse of both.

At each square the best model is the first that knows all that the square touches. Its highest cell counts, raised by
as much as its error is larger than the smallest of all. Where another model is the best within the reach of a seam,
that one counts too, and the higher of both is taken: objects at the edge of a model may be missing in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from affine import Affine
from scipy.ndimage import distance_transform_cdt, maximum_filter1d, minimum_filter1d

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
    """From how far around a part others decide what counts in it, of the models that reach into the part."""
    pairs = (seam_m(one, other) for one in models for other in models if one is not other)
    return max(pairs, default=SEAM_M)


def meeting(models: Sequence[CatalogueModel], bounds_m: tuple[float, float, float, float]) -> list[CatalogueModel]:
    """Those whose extents meet (west, south, east, north), an edge in common included."""
    west, south, east, north = bounds_m
    within = [model.file.bounds_m for model in models]
    return [
        model
        for model, (w, s, e, n) in zip(models, within, strict=True)
        if w <= east and west <= e and s <= north and south <= n
    ]


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
    for number, part, touched, counts in _one_by_one(layers, transform, best, progress):
        layer = layers[number]
        seam[part] |= counts & (best[part] != number)
        np.fmax(high_m[part], touched.high_m + np.float32(layer.raise_m), out=high_m[part], where=counts)
        np.fmin(low_m[part], touched.low_m - np.float32(layer.drop_m), out=low_m[part], where=counts)
    unknown = best == NO_MODEL
    high_m[unknown] = low_m[unknown] = np.nan
    return Surface(high_m, low_m, best, (seam | _near_another(best, transform.a)) & ~unknown)


def counting_in(
    layers: Sequence[Layer], transform: Affine, shape: tuple[int, int], inner: tuple[slice, slice]
) -> set[int]:
    """Which layers count anywhere in the ``inner`` (rows, columns) of a north-up grid."""
    found, best = set[int](), np.full(shape, NO_MODEL, np.uint8)
    for number, part, _, counts in _one_by_one(layers, transform, best, lambda share: None):
        everywhere = np.zeros(shape, np.bool_)
        everywhere[part] = counts
        if everywhere[inner].any():
            found.add(number)
    return found


def _one_by_one(
    layers: Sequence[Layer], transform: Affine, best: np.ndarray, progress: Callable[[float], None]
) -> Iterator[tuple[int, tuple[slice, slice], Touched, Bools]]:
    """Of each layer that reaches into the grid: its number, where, what is touched of it, and where of that it counts.

    ``best`` is filled in as they come. Only the squares that a layer reaches into are looked at.
    """
    for number, layer in enumerate(layers):
        progress(number / len(layers))
        part = _reached(layer.model, transform, best.shape)
        if part is None:
            continue
        if not (best == NO_MODEL).any():
            break
        touched = _touched(layer.model, transform, part)
        layer.model.file.forget()
        here = best[part]
        here[touched.whole & (here == NO_MODEL)] = number
        counts = _counting(layers, number, here, transform.a) | (here == number)
        counts |= ~touched.whole & (here > number)  # an edge: what of it is known stands there all the same
        yield number, part, touched, counts & ~np.isnan(touched.high_m)


def _counting(layers: Sequence[Layer], number: int, here: np.ndarray, cell_m: float) -> Bools:
    """Where a better model is the best, and this one is within the reach of their seam.

    ``here``: the best of each square that this one reaches into; it is the best in no other.
    """
    mine, counts = here == number, np.zeros(here.shape, np.bool_)
    seams_px = np.full(NO_MODEL + 1, -1, np.int32)
    for better in np.flatnonzero(np.bincount(here.ravel(), minlength=number)[:number]).tolist():
        seams_px[better] = math.ceil(seam_m(layers[number].model, layers[better].model) / cell_m) + 1
    if not mine.any() or seams_px.max() < 0:
        return counts
    part = tuple(_spanned(mine.any(axis=1 - axis), int(seams_px.max())) for axis in (0, 1))
    # Squares around a square: the larger of rows and columns between both. They hold the disc.
    apart_px = np.asarray(distance_transform_cdt(~mine[part], metric="chessboard"))
    counts[part] = apart_px <= seams_px[here[part]]
    return counts


def _spanned(some: Bools, around: int) -> slice:
    """From the first that is true to the last, and so many more."""
    places = np.flatnonzero(some)
    return slice(max(0, int(places[0]) - around), int(places[-1]) + 1 + around)


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


def _reached(model: CatalogueModel, transform: Affine, shape: tuple[int, ...]) -> tuple[slice, slice] | None:
    """Rows and columns of the grid that a model reaches into; None: none."""
    west, south, east, north = model.file.bounds_m
    cell_m = transform.a
    row0, row1 = _clipped((transform.f - north) / cell_m, (transform.f - south) / cell_m, shape[0])
    column0, column1 = _clipped((west - transform.c) / cell_m, (east - transform.c) / cell_m, shape[1])
    return (slice(row0, row1), slice(column0, column1)) if row0 < row1 and column0 < column1 else None


def _touched(model: CatalogueModel, transform: Affine, part: tuple[slice, slice]) -> Touched:
    """What the squares of a part of the grid touch of a model."""
    rows, columns = part
    corner, shape = transform @ Affine.translation(columns.start, rows.start), (len_of(rows), len_of(columns))
    return touched_cells(_around(model.file.window, model.file.transform, corner, shape).cells, corner, shape)


def len_of(part: slice) -> int:
    return part.stop - part.start


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
