"""How near positions come to the surface model: straight down, and in space with every cell a solid column."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from planning.certificate.nearest import nearest_distances, threads_for
from planning.certificate.pyramid import cells_pyramid
from planning.terrain import SMALL_HOLE_M2
from planning.terrain.dsm import Dsm, true_cells
from planning.terrain.holes import fill_holes

ALONE = 256
"""Positions up to which waking a second thread costs more than it brings."""


class SurfaceDistance:
    """A surface model made ready for many questions; small holes are filled, other unknown cells reach up forever."""

    def __init__(self, dsm: Dsm, *, fill_hole_area_m2: float = SMALL_HOLE_M2) -> None:
        self.dsm, _ = fill_holes(dsm, max_area_m2=fill_hole_area_m2)
        west, south, east, north = self.dsm.bounds_m
        cells = true_cells(self.dsm, np.array([(west, south), (west, north), (east, south), (east, north)]))
        self._layout, self._pyramid = cells.layout, cells_pyramid(cells)

    def heights_m(self, xyz_m: F64) -> F64:
        """(N,) height of (N, 3) positions (x, y, alt_dsm) above the cell below; NaN over unknown cells and outside."""
        return xyz_m[:, 2] - self.dsm.elevation_at(xyz_m[:, :2])

    def distances_m(self, xyz_m: F64) -> F64:
        """(N,) distance in space of (N, 3) positions to the nearest cell, 0 inside one; NaN over unknown cells."""
        dsm = self.dsm
        places = self._layout.in_frame(xyz_m)
        known = np.isfinite(places).all(axis=1) & np.isfinite(dsm.elevation_at(xyz_m[:, :2]))
        out = np.full(len(places), np.nan)
        with threads_for(0 if known.sum() <= ALONE else dsm.elevation_m.size):
            out[known], _ = nearest_distances(self._pyramid, places[known], places[known])
        return out

    def distance_m(self, xyz_m: tuple[float, float, float]) -> float | None:
        """The same of one position, None where it cannot be told."""
        distance = self.distances_m(np.array([xyz_m], dtype=np.float64))[0]
        return None if np.isnan(distance) else float(distance)

    def height_m(self, xyz_m: tuple[float, float, float]) -> float | None:
        """Height of one position above the cell below, None where it is unknown."""
        height = self.heights_m(np.array([xyz_m], dtype=np.float64))[0]
        return None if np.isnan(height) else float(height)
