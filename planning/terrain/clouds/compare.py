"""A cloud's heights against a surface model's, in place: all of it moved, or parts that stand above the model alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm

ABOVE_M = 2.0
"""What stands so far above the model is no noise of either: a tree, a roof, or another datum."""
_MOST_CELLS = 200_000
_PLACES = 5
"""Along each side of a cell at which the model is looked at, the outermost just inside."""
_INSIDE = 1.0 - 1e-6


@dataclass(frozen=True, slots=True)
class Compared:
    """Tops of the cloud's cells minus the model's greatest height in the same cells, metres."""

    cells: int
    low_m: float
    """10th percentile: near 0 where parts of the cloud stand above the model, high where all of it does."""
    median_m: float
    high_m: float
    """90th percentile."""
    off_m: float
    """Median of the amounts: what lies beside its place is above here and below there."""
    above_share: float
    """Of cells that stand more than ``ABOVE_M`` above all that the model has in them and one of its cells around."""
    above_m: float
    """The farthest that one of them stands above that."""


def tops_of(cloud: Dsm) -> F64:
    """(N, 3) middle and highest point of the cloud's cells, of many an even choice, in the cloud's own system."""
    rows, columns = np.nonzero(np.isfinite(cloud.elevation_m))
    every = -(-len(rows) // _MOST_CELLS) or 1
    rows, columns = rows[::every], columns[::every]
    west_m, north_m, cell_m = cloud.transform.c, cloud.transform.f, cloud.resolution_m
    heights_m = cloud.elevation_m[rows, columns].astype(np.float64)
    x_m, y_m = west_m + (columns + 0.5) * cell_m, north_m - (rows + 0.5) * cell_m
    return np.column_stack([x_m, y_m, heights_m]).astype(np.float64)


def compared(tops_m: F64, cell_m: float, dsm: Dsm) -> Compared | None:
    """(N, 3) tops in the model's system, of cells ``cell_m`` wide. None where no cell lies over known ones."""
    tops_m = tops_m[np.isfinite(tops_m).all(axis=1)]
    within_m = _greatest_m(dsm, tops_m, cell_m / 2)
    around_m = np.fmax(within_m, _greatest_m(dsm, tops_m, cell_m / 2 + dsm.resolution_m))
    known = np.isfinite(within_m)
    if not known.any():
        return None
    apart_m, above_m = (tops_m[known, 2] - there_m[known] for there_m in (within_m, around_m))
    low_m, median_m, high_m = np.percentile(apart_m, (10, 50, 90))
    return Compared(
        int(known.sum()), float(low_m), float(median_m), float(high_m), float(np.median(np.abs(apart_m))),
        float((above_m > ABOVE_M).mean()), float(above_m.max()),
    )  # fmt: skip


def _greatest_m(dsm: Dsm, tops_m: F64, reach_m: float) -> F64:
    """(N,) the model's greatest height in a square around each place; NaN where none is known."""
    grid, found = dsm.as_grid(), np.full(len(tops_m), np.nan)
    steps = np.linspace(-reach_m, reach_m, _PLACES) * _INSIDE
    for east_m in steps:
        for north_m in steps:
            found = np.fmax(found, grid.elevation_at(tops_m[:, :2] + (east_m, north_m)))
    return found
