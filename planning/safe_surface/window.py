"""Rectangles of cells: which part of a model a computation needs, and which part of its result is wanted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from planning.errors import ParameterError
from planning.terrain.dsm import Dsm, SurfaceModel


@dataclass(frozen=True, slots=True)
class Box:
    """Cells row0 <= row < row1, col0 <= column < col1."""

    row0: int
    col0: int
    row1: int
    col1: int

    @classmethod
    def of(cls, dsm: Dsm) -> Box:
        return cls(0, 0, dsm.height_px, dsm.width_px)

    @classmethod
    def around(cls, dsm: Dsm, xy_m: F64, margin_m: float) -> Box:
        """The model's cells within ``margin_m`` of the points' bounding box; ParameterError if there are none."""
        row_f, col_f = dsm.fractional_cell(xy_m)
        corners = np.array([row_f.min(), col_f.min(), row_f.max(), col_f.max()]) if row_f.size else np.full(4, np.nan)
        margin_px = margin_m / dsm.resolution_m
        first, last = corners[:2] - margin_px, corners[2:] + margin_px
        # Written so that NaN fails too.
        if not (np.all(last >= 0) and np.all(first < dsm.elevation_m.shape)):
            raise ParameterError(
                "None of the points lies on the surface model.",
                advice="Check that the points and the surface model belong to the same place.",
            )
        # One cell more, because heights between cell centres are interpolated.
        r0, c0 = np.floor(np.maximum(first - 1, 0)).astype(int)
        r1, c1 = np.floor(np.minimum(last + 2, dsm.elevation_m.shape)).astype(int)
        return cls(int(r0), int(c0), int(r1), int(c1))

    @property
    def shape(self) -> tuple[int, int]:
        return self.row1 - self.row0, self.col1 - self.col0

    def grown(self, px: int, shape: tuple[int, int]) -> Box:
        """The box with ``px`` cells more on each side, clipped to a grid of (rows, columns)."""
        return Box(
            max(0, self.row0 - px),
            max(0, self.col0 - px),
            min(shape[0], self.row1 + px),
            min(shape[1], self.col1 + px),
        )

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns of an array of the whole grid."""
        return slice(self.row0, self.row1), slice(self.col0, self.col1)

    def relative_to(self, outer: Box, block_px: int) -> Box:
        """This box in blocks of a grid that starts at ``outer``, one block wider for interpolation if there are any."""
        spare = int(block_px > 1)
        return Box(
            (self.row0 - outer.row0) // block_px - spare,
            (self.col0 - outer.col0) // block_px - spare,
            -(-(self.row1 - outer.row0) // block_px) + spare,
            -(-(self.col1 - outer.col0) // block_px) + spare,
        )

    def cut(self, model: SurfaceModel) -> Dsm:
        """The model's part inside the box, clipped to the model; a view where the model is in memory."""
        return model.window(self.row0, self.col0, *self.shape)
