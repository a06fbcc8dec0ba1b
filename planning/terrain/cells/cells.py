"""The cells of a raster as quadrilaterals in a model's reference system: what the clearance is proved against."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F32, F64
from planning.errors import RasterFormatError
from planning.terrain.cells.lattice import Lattice, corner, places_of, straight

Mapping = Callable[[F64, F64], tuple[F64, F64]]
"""Raster column, row (fractional) -> projected x, y."""

NODE_M, FARTHEST_NODE_M = 48.0, 100.0
"""Between corners that are projected exactly: a map projection bends by less than 0.1 and 1 mm over such spans."""
_FEW_PX, _MOST_NODE_PX = 8, 64
"""Over fewer cells than these the span is the longer one, and what is kept of a large model stays small."""
_STRAIGHT_M = 1e-5
"""Cells nowhere farther than this from parallelograms are taken as such."""
_RECTANGULAR_M = 1e-6
_EDGE_POINTS = 9
_TOUCH_PX = 1e-6


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the cells of a raster lie, without their heights."""

    lattice: Lattice
    origin_xy_m: tuple[float, float]
    """Of the lattice's frame, projected."""
    turn: F64
    """(2, 2) orthogonal: projected metres from the origin -> the lattice's frame."""
    shape: tuple[int, int]
    """Rows, columns."""
    stretch: float = 1.0
    """Projected metres in one of the lattice's frame, which are then true on the ground."""

    def in_frame(self, points_m: F64) -> F64:
        """Projected (N, 2) or (N, 3) points in the lattice's frame; altitudes stay."""
        points = np.asarray(points_m, dtype=np.float64)
        flat = (points[:, :2] - np.array(self.origin_xy_m)) @ self.turn.T / self.stretch
        return np.ascontiguousarray(np.column_stack([flat, points[:, 2:]]))

    def places(self, xy_m: F64) -> F64:
        """(N, 2) rows and columns, in cells, of projected (N, 2) places."""
        flat = self.in_frame(np.asarray(xy_m, dtype=np.float64).reshape(-1, 2))
        out = np.empty_like(flat)
        places_of(self.lattice, flat, out)
        return out

    def xy_of(self, row: float, column: float) -> tuple[float, float]:
        """Projected place of a row and column, in cells."""
        return self._projected(np.array(corner(self.lattice, float(row), float(column))))

    def _projected(self, place_m: F64) -> tuple[float, float]:
        """Of a place in the frame."""
        x, y = np.array(self.origin_xy_m) + self.stretch * (self.turn.T @ place_m)
        return float(x), float(y)

    def part(self, row0: int, column0: int, shape: tuple[int, int]) -> Layout:
        """The layout of a block of cells, which may reach outside."""
        grid = self.lattice
        first = np.array([column0 * grid.width_m + row0 * grid.shear_m, row0 * grid.height_m])
        lattice = grid._replace(first_row=grid.first_row + row0, first_column=grid.first_column + column0)
        return replace(self, lattice=lattice, origin_xy_m=self._projected(first), shape=shape)

    def measured_in(self, stretch: float) -> Layout:
        """The same places in a frame whose metre is ``stretch`` projected ones."""
        grid, ratio = self.lattice, self.stretch / stretch
        lattice = grid._replace(
            width_m=ratio * grid.width_m,
            height_m=ratio * grid.height_m,
            shear_m=ratio * grid.shear_m,
            bend_m=ratio * grid.bend_m,
        )
        return replace(self, lattice=lattice, stretch=stretch)

    def reach(self, low_xy_m: F64, high_xy_m: F64) -> tuple[slice, slice]:
        """Rows and columns that hold every cell touching the projected rectangle; may be empty."""
        (west, south), (east, north) = low_xy_m, high_xy_m
        share = np.linspace(0.0, 1.0, _EDGE_POINTS)
        x, y = west + share * (east - west), south + share * (north - south)
        outline_x = np.concatenate([x, x, np.full(_EDGE_POINTS, west), np.full(_EDGE_POINTS, east)])
        outline_y = np.concatenate([np.full(_EDGE_POINTS, south), np.full(_EDGE_POINTS, north), y, y])
        places = self.places(np.column_stack([outline_x, outline_y]))
        first = np.floor(places.min(axis=0) - _TOUCH_PX).astype(int)
        stop = np.floor(places.max(axis=0) + _TOUCH_PX).astype(int) + 1
        rows, columns = (
            slice(*np.clip((a, b), 0, n).tolist()) for a, b, n in zip(first, stop, self.shape, strict=True)
        )
        return rows, columns


@dataclass(frozen=True, slots=True)
class Cells:
    """Heights, and where each of them reaches."""

    elevation_m: F32
    """(H, W); not finite where unknown; read-only. Everything outside is unknown, too."""
    layout: Layout

    def __post_init__(self) -> None:
        self.elevation_m.flags.writeable = False

    @property
    def area_m2(self) -> float:
        """Of one cell."""
        return self.layout.lattice.width_m * self.layout.lattice.height_m

    def elevation_at(self, xy_m: F64) -> F64:
        """(N,) height of the cell that holds each projected place; NaN outside or unknown."""
        row, column = self.layout.places(xy_m).T
        out = np.full(row.shape, np.nan)
        height_px, width_px = self.elevation_m.shape
        inside = (row >= 0) & (row < height_px) & (column >= 0) & (column < width_px)
        out[inside] = self.elevation_m[row[inside].astype(np.intp), column[inside].astype(np.intp)]
        return out

    def measured_in(self, stretch: float) -> Cells:
        """The same cells in a frame whose metre is ``stretch`` projected ones."""
        return self if stretch == self.layout.stretch else replace(self, layout=self.layout.measured_in(stretch))

    def with_elevation(self, elevation_m: F32) -> Cells:
        """The same cells with other heights."""
        return replace(self, elevation_m=elevation_m)

    def around(self, low_xy_m: F64, high_xy_m: F64) -> Cells:
        """The cells that touch a projected rectangle, within a ring of unknown ones."""
        rows, columns = self.layout.reach(low_xy_m, high_xy_m)
        return cut_out(self.layout, rows.start, columns.start, self.elevation_m[rows, columns])


def cut_out(layout: Layout, row0: int, column0: int, elevation_m: F32) -> Cells:
    """The cells of a layout from (row0, column0) on that have these heights, within a ring of unknown ones."""
    inner = ringed(elevation_m)
    return Cells(inner, layout.part(row0 - 1, column0 - 1, inner.shape))


def square_cells(elevation_m: F32, resolution_m: float, north_west_xy_m: tuple[float, float]) -> Cells:
    """North-up squares."""
    turn = np.array([[1.0, 0.0], [0.0, -1.0]])
    return Cells(elevation_m, Layout(straight(resolution_m, resolution_m), north_west_xy_m, turn, elevation_m.shape))


@dataclass(frozen=True, slots=True)
class Placing:
    """Where a raster's cells lie, a ring of unknown ones around them included."""

    layout: Layout
    mirrored: bool
    """Its columns are taken from the last to the first: rows then follow each other to the right of the columns."""

    def cells(self, stored: F32) -> Cells:
        """With the raster's (H, W) heights."""
        return Cells(ringed(stored[:, ::-1] if self.mirrored else stored), self.layout)


def place_cells(shape: tuple[int, int], forward: Mapping) -> Placing:
    """Where ``forward`` puts the (rows, columns) of a raster; RasterFormatError where it is torn or folded."""
    mirrored = _is_mirrored(shape, forward)

    def outward(column: F64, row: F64) -> tuple[F64, F64]:
        return forward(shape[1] + 1.0 - column if mirrored else column - 1.0, row - 1.0)

    layout = _laid_out((shape[0] + 2, shape[1] + 2), outward)
    _refuse_folds(layout.lattice)
    return Placing(layout, mirrored)


def ringed(elevation_m: F32) -> F32:
    """A copy with one unknown cell more on each side: what a line meets where the raster ends."""
    out = np.full((elevation_m.shape[0] + 2, elevation_m.shape[1] + 2), np.nan, dtype=np.float32)
    out[1:-1, 1:-1] = elevation_m
    return out


def _is_mirrored(shape: tuple[int, int], forward: Mapping) -> bool:
    """Whether rows follow each other to the left of the columns' direction, not to its right as south of east."""
    column, row = shape[1] / 2, shape[0] / 2
    columns = np.array([column, column + 1.0, column], dtype=np.float64)
    x, y = forward(columns, np.array([row, row, row + 1.0], dtype=np.float64))
    return bool((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]) > 0.0)


def _laid_out(shape: tuple[int, int], forward: Mapping) -> Layout:
    height, width = shape
    x, y = forward(
        np.array([0.0, width, width / 2, width / 2, width / 2]),
        np.array([height / 2, height / 2, 0.0, height, height / 2]),
    )
    along = np.array([x[1] - x[0], y[1] - y[0]]) / width
    down = np.array([x[3] - x[2], y[3] - y[2]]) / height
    width_m = math.hypot(*along)
    east = along / width_m
    turn = np.array([east, [east[1], -east[0]]])  # the second axis points to the right of the first
    shear_m, height_m = turn @ down
    if abs(shear_m) * height < _RECTANGULAR_M:
        shear_m = 0.0
    corner_x, corner_y = np.array([x[4], y[4]]) - along * width / 2 - down * height / 2
    layout = Layout(straight(width_m, height_m, shear_m), (float(corner_x), float(corner_y)), turn, shape)
    side_m = max(width_m, height_m)
    least_px = np.clip(FARTHEST_NODE_M / side_m, 1, _FEW_PX)
    node_px = int(np.clip(NODE_M / side_m, least_px, _MOST_NODE_PX))
    bend_m = _bend(layout, forward, node_px)
    if np.abs(bend_m).max() < _STRAIGHT_M:
        return layout
    return replace(layout, lattice=layout.lattice._replace(bend_m=bend_m, node_px=node_px))


def _bend(layout: Layout, forward: Mapping, node_px: int) -> F64:
    """(N, M, 2) how far the raster's corners lie from the straight lattice's, at every ``node_px``-th of them."""
    rows, columns = (np.arange(-(-side // node_px) + 1, dtype=np.float64) * node_px for side in layout.shape)
    grid_columns, grid_rows = np.meshgrid(columns, rows)
    x, y = forward(grid_columns.ravel(), grid_rows.ravel())
    bend_m = layout.in_frame(np.column_stack([x, y])).reshape(*grid_rows.shape, 2)
    lattice = layout.lattice
    bend_m[..., 0] -= grid_columns * lattice.width_m + grid_rows * lattice.shear_m
    bend_m[..., 1] -= grid_rows * lattice.height_m
    if not np.isfinite(bend_m).all():
        raise RasterFormatError(
            "A part of it lies outside the map projection's area.", advice="Crop it to the area of the flight."
        )
    return bend_m


def _refuse_folds(lattice: Lattice) -> None:
    """The search for a place and the distance to a cell hold for a lattice that is bent a little, not folded."""
    if lattice.bend_m.shape[0] == 0:
        return
    most_m = 0.25 * min(lattice.width_m, lattice.height_m) * lattice.node_px
    if max(np.abs(np.diff(lattice.bend_m, axis=axis)).max() for axis in (0, 1)) > most_m:
        raise RasterFormatError(
            "It covers so large an area that its cells are bent out of shape.",
            advice="Crop it to the area of the flight.",
        )
