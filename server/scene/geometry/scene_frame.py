"""Between the surface model's coordinates and the 3D view's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from planning.terrain.dsm import Dsm
from server.scene.geometry.payload import HeightGrid


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Scene coordinates: x east, y north in metres from the model's centre, z = height above the model's lowest
    place times the exaggeration. Small numbers, because browsers draw in 32 bits."""

    centre_x_m: float
    centre_y_m: float
    reference_alt_dsm_m: float
    exaggeration: float
    half_diagonal_m: float
    """Horizontal: what sizes of marks and distances of cameras are measured in."""

    @staticmethod
    def of(dsm: Dsm, grid: HeightGrid, exaggeration: float) -> LocalFrame:
        west, south, east, north = dsm.bounds_m
        return LocalFrame(
            centre_x_m=(west + east) / 2,
            centre_y_m=(south + north) / 2,
            reference_alt_dsm_m=float(np.nanmin(grid.alt_dsm_m)),
            exaggeration=exaggeration,
            half_diagonal_m=float(np.hypot(east - west, north - south)) / 2,
        )

    @property
    def _origin_m(self) -> F64:
        return np.array([self.centre_x_m, self.centre_y_m, self.reference_alt_dsm_m])

    @property
    def _stretch(self) -> F64:
        return np.array([1.0, 1.0, self.exaggeration])

    def scene_from_model(self, points_m: F64) -> F64:
        """(..., 3) x, y, alt_dsm -> scene."""
        return (np.asarray(points_m, dtype=np.float64) - self._origin_m) * self._stretch

    def model_from_scene(self, points: F64) -> F64:
        """(..., 3) scene -> x, y, alt_dsm."""
        return np.asarray(points, dtype=np.float64) / self._stretch + self._origin_m

    def model_direction(self, direction: F64) -> F64:
        """(..., 3) a direction in the scene -> the same in the model; lengths along a ray stay comparable."""
        return np.asarray(direction, dtype=np.float64) / self._stretch

    @property
    def floor_alt_dsm_m(self) -> float:
        """The height at which unknown terrain is drawn and clicked: below everything known."""
        return self.reference_alt_dsm_m - 0.02 * self.half_diagonal_m
