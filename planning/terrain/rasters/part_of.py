"""A part of the surface model that a raster becomes: which pixels it needs, and the part made of them."""

from __future__ import annotations

import numpy as np
from affine import Affine

from mapping.geometry.arrays import F32
from planning.terrain.cells.cells import Cells, Placing, cut_out
from planning.terrain.cells.squares import squares_of_part
from planning.terrain.dsm import Dsm
from planning.terrain.rasters.assemble import north_up_grid
from planning.terrain.rasters.reading import Pixels
from planning.terrain.rasters.surface_plan import SurfacePlan

Part = tuple[slice, slice]
"""Rows and columns."""

_SQUARES_AROUND = 2
"""A square reaches into cells that touch its neighbours."""


def model_grid(plan: SurfacePlan) -> tuple[Affine, tuple[int, int]]:
    """Transform and (rows, columns) of the whole model."""
    return plan.grid or north_up_grid(plan.affine, (plan.header.height_px, plan.header.width_px))


def needed_pixels(plan: SurfacePlan, part: Part) -> Pixels:
    """The raster's pixels that a part of the model's grid, and the cells that touch it, are made of."""
    boxes: list[Part] = []
    if plan.grid is None:
        boxes.append(_stored(plan, part))
    if plan.placing is not None:
        boxes.append(_raster_pixels(plan, *_touched(plan, plan.placing, part, around=_SQUARES_AROUND)))
    (row0, row1), (column0, column1) = (
        (min(box[axis].start for box in boxes), max(box[axis].stop for box in boxes)) for axis in (0, 1)
    )
    return Pixels(row0, column0, row1 - row0, column1 - column0)


def part_of(plan: SurfacePlan, stored: F32, pixels: Pixels, part: Part, *, sha256: str, name: str) -> Dsm:
    """The very part that ``Dsm.window`` gives of the whole model; ``stored`` are the raster's ``pixels``, in metres."""
    grid, shape = model_grid(plan)
    transform = grid @ Affine.translation(part[1].start, part[0].start)
    source = None
    if plan.placing is not None:
        source = _cells(plan, plan.placing, stored, pixels, *_touched(plan, plan.placing, part, around=0))
    if plan.grid is None:
        rows, columns = _stored(plan, part)
        cut = stored[_within(rows, pixels.row0), _within(columns, pixels.column0)]
        t = plan.affine
        elevation_m = np.ascontiguousarray(cut[:: -1 if t.e > 0 else 1, :: -1 if t.a < 0 else 1])
    else:
        assert plan.placing is not None
        rows, columns = _touched(plan, plan.placing, part, around=_SQUARES_AROUND)
        patch = _patch(plan, plan.placing, stored, pixels, rows, columns)
        first = (rows.start, columns.start)
        elevation_m = squares_of_part(plan.placing.layout, patch, first, grid, shape, part)
    return Dsm(elevation_m, transform, plan.crs, plan.reference.vertical_datum, sha256, source, name)


def _stored(plan: SurfacePlan, part: Part) -> Part:
    """The raster's rows and columns of a part of the grid that has one square for each pixel."""
    rows, columns = part
    t, header = plan.affine, plan.header
    return (
        slice(header.height_px - rows.stop, header.height_px - rows.start) if t.e > 0 else rows,
        slice(header.width_px - columns.stop, header.width_px - columns.start) if t.a < 0 else columns,
    )


def _touched(plan: SurfacePlan, placing: Placing, part: Part, *, around: int) -> Part:
    """Rows and columns, the ring counted, of the cells that touch a part of the grid and ``around`` squares more."""
    grid, _ = model_grid(plan)
    transform = grid @ Affine.translation(part[1].start, part[0].start)
    rows, columns = part[0].stop - part[0].start, part[1].stop - part[1].start
    low, high = transform @ (-around, rows + around), transform @ (columns + around, -around)
    return placing.layout.reach(np.array(low), np.array(high))


def _raster_pixels(plan: SurfacePlan, rows: slice, columns: slice) -> Part:
    """The raster's rows and columns of some cells, whose ring is none of the raster's."""
    height, width = plan.header.height_px, plan.header.width_px
    row0, row1 = (min(max(edge - 1, 0), height) for edge in (rows.start, rows.stop))
    column0, column1 = (min(max(edge - 1, 0), width) for edge in (columns.start, columns.stop))
    if plan.placing is not None and plan.placing.mirrored:
        column0, column1 = width - column1, width - column0
    return slice(row0, max(row0, row1)), slice(column0, max(column0, column1))


def _cells(plan: SurfacePlan, placing: Placing, stored: F32, pixels: Pixels, rows: slice, columns: slice) -> Cells:
    patch = _patch(plan, placing, stored, pixels, rows, columns)
    return cut_out(placing.layout, rows.start, columns.start, patch)


def _patch(plan: SurfacePlan, placing: Placing, stored: F32, pixels: Pixels, rows: slice, columns: slice) -> F32:
    """Heights of the cells in these rows and columns, the ring's unknown."""
    out = np.full((rows.stop - rows.start, columns.stop - columns.start), np.nan, dtype=np.float32)
    raster_rows, raster_columns = _raster_pixels(plan, rows, columns)
    cut = stored[_within(raster_rows, pixels.row0), _within(raster_columns, pixels.column0)]
    if placing.mirrored:
        cut = cut[:, ::-1]
    row, column = max(1 - rows.start, 0), max(1 - columns.start, 0)
    out[row : row + cut.shape[0], column : column + cut.shape[1]] = cut
    return out


def _within(part: slice, first: int) -> slice:
    return slice(part.start - first, part.stop - first)
