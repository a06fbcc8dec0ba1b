"""The cells that a point cloud is sorted into, and the sorting."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mapping.geometry.arrays import F32, F64, I64, U8, Bools
from planning.errors import RasterFormatError, RasterTooLargeError
from planning.terrain.clouds.cloud import Box

GROUND = 2
NOISE = (7, 18)
_POINTS_PER_CELL = 4.0
_SIZES_M = (0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 5.0)


@dataclass(frozen=True, slots=True)
class CloudGrid:
    """Square cells, north up, at multiples of their size."""

    west_m: float
    north_m: float
    cell_m: float
    shape: tuple[int, int]


def cell_for(bounds_m: Box, points: int) -> float:
    """The size at which about four points fall into a cell of the box around all of them, rounded up."""
    west, south, east, north = bounds_m
    wanted_m = math.sqrt(_POINTS_PER_CELL * (east - west) * (north - south) / max(points, 1))
    return next((size_m for size_m in _SIZES_M if size_m >= wanted_m), _SIZES_M[-1])


def grid_for(bounds_m: Box, cell_m: float, *, max_px: int) -> CloudGrid:
    """RasterTooLargeError when it has more than ``max_px`` cells."""
    west, south, east, north = bounds_m
    if not (all(map(math.isfinite, bounds_m)) and west <= east and south <= north):
        raise RasterFormatError(f"Its bounds make no box: {bounds_m}.", advice="Export it again.")
    if max(east - west, north - south) / cell_m > max_px:
        rows = columns = max_px
    else:
        column0, row0 = math.floor(west / cell_m), math.ceil(north / cell_m)
        columns, rows = math.floor(east / cell_m) - column0 + 1, row0 - math.ceil(south / cell_m) + 1
        if rows * columns <= max_px:
            return CloudGrid(column0 * cell_m, row0 * cell_m, cell_m, (rows, columns))
    raise RasterTooLargeError(
        f"It spans {east - west:,.0f} x {north - south:,.0f} m: in cells of {cell_m:g} m that are more than "
        f"{max_px:,}.",
        advice="Give larger cells with --cell-m, or crop the cloud to the area of the flight.",
    )


@dataclass(slots=True)
class Sorter:
    """Takes points chunk by chunk and keeps the highest of each cell: of all of them, and of the ground alone."""

    grid: CloudGrid
    highest_m: F32
    """(H, W), written in place; -inf where there is no point."""
    ground_m: F32 | None
    keep_noise: bool = False
    taken: int = 0
    ground: int = 0
    noise: int = 0
    not_numbers: int = 0
    outside: int = 0
    classes: I64 = field(default_factory=lambda: np.zeros(256, np.int64))
    """(256,) how many of the points that were taken are of each class."""

    def add(self, xyz_m: F64, classes: U8 | None) -> Bools:
        """(N, 3) projected x, y and height in metres, and (N,) ASPRS classes. Returns which of them were taken."""
        taken = np.isfinite(xyz_m).all(axis=1)
        self.not_numbers += int((~taken).sum())
        if classes is not None and not self.keep_noise:
            noise = taken & ((classes == NOISE[0]) | (classes == NOISE[1]))
            self.noise += int(noise.sum())
            taken &= ~noise
        cells, inside = self._cells(xyz_m)
        self.outside += int((taken & ~inside).sum())
        taken &= inside
        self._sort(cells[taken], rounded_up(xyz_m[taken, 2]), None if classes is None else classes[taken])
        return taken

    def _sort(self, cells: I64, heights_m: F32, classes: U8 | None) -> None:
        self.taken += len(cells)
        np.maximum.at(self.highest_m.reshape(-1), cells, heights_m)
        if classes is not None and self.ground_m is not None:
            self.classes += np.bincount(classes, minlength=256)
            ground = classes == GROUND
            self.ground += int(ground.sum())
            np.maximum.at(self.ground_m.reshape(-1), cells[ground], heights_m[ground])

    def _cells(self, xyz_m: F64) -> tuple[I64, Bools]:
        rows_count, columns_count = self.grid.shape
        with np.errstate(invalid="ignore", over="ignore"):
            columns = np.floor((xyz_m[:, 0] - self.grid.west_m) / self.grid.cell_m)
            rows = np.floor((self.grid.north_m - xyz_m[:, 1]) / self.grid.cell_m)
            inside = (columns >= 0) & (columns < columns_count) & (rows >= 0) & (rows < rows_count)
            return (rows * columns_count + columns).astype(np.int64), inside


def rounded_up(heights_m: F64) -> F32:
    """In 32 bits, and never below."""
    with np.errstate(over="ignore"):
        near = heights_m.astype(np.float32)
    low = near < heights_m
    near[low] = np.nextafter(near[low], np.float32(np.inf))
    return near
