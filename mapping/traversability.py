"""Traversability of ground: slope, roughness and the index that says where a vehicle can drive.

After Ye and Borenstein's method as Ahtiainen uses it ("Augmenting Traversability Maps with Ultra-Wideband Radar").
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.errors import CapacityError, ParameterError
from mapping.geometry.arrays import F32, Bools

MOST_CELLS = 36_000_000
"""Some 0.5 GB of layers: 6000 x 6000 cells, 1.8 km square at 0.3 m."""


@dataclass(frozen=True, slots=True)
class TraversabilityParams:
    """The index is ``slope_weight * slope [deg] + roughness_weight * roughness [m]``.

    The weights of Ye and Borenstein are the platform's own and not printed: ours stop a vehicle at a slope of 40 deg
    or at 0.08 m of roughness, a step of 0.16 m. On coarse cells, where three are more than ``patch_m``, roughness
    weighs less by the root of that: so does the roughness of natural ground grow with the length it is measured over.
    """

    patch_m: float = 0.5
    """Side of the square to which a plane is fitted; at least 3 cells are taken."""
    slope_weight: float = 1.0
    roughness_weight: float = 500.0
    untraversable_index: float = 40.0
    """T_i of the paper."""
    known_share: float = 0.6
    """Of a patch's cells; with less its plane says nothing and the cell is unknown. Or of finer cells taken as one."""


@dataclass(frozen=True, slots=True)
class Traversability:
    """Layers (rows, cols) on the elevation's grid; NaN where the ground is unknown."""

    slope_rad: F32
    roughness_m: F32
    """Root of the mean squared distance of the patch's cells from their plane, along the vertical."""
    index: F32
    """tau"""
    elevation_m: F32
    """What they were worked out from; known on some cells whose index is not."""
    resolution_m: float
    untraversable_index: float = 40.0

    @property
    def value(self) -> F32:
        """tau / T_i, at most 1: T_m of the paper."""
        return np.minimum(self.index / np.float32(self.untraversable_index), np.float32(1.0))

    @property
    def untraversable(self) -> Bools:
        return self.index >= self.untraversable_index

    @property
    def known(self) -> Bools:
        return np.isfinite(self.index)


def traversability_map(
    elevation_m: NDArray[np.floating], resolution_m: float, params: TraversabilityParams | None = None
) -> Traversability:
    """Slope, roughness and index of every cell of (rows, cols) heights on square cells; NaN unknown.

    A plane is fitted to the known cells of the patch around each cell by least squares, heights along the vertical.
    Raises ParameterError for a grid or numbers that make no sense, CapacityError beyond ``MOST_CELLS``.
    """
    params = params or TraversabilityParams()
    _check(elevation_m, resolution_m, params)
    half = patch_reach(resolution_m, params)
    slope_rad = np.empty(elevation_m.shape, np.float32)
    roughness_m = np.empty(elevation_m.shape, np.float32)
    heights_m = np.ascontiguousarray(elevation_m, np.float32)
    across_m = (2 * half + 1) * resolution_m
    least = max(4, math.ceil(params.known_share * (2 * half + 1) ** 2))
    # The model's rim has half a patch, its corners a quarter.
    _fit_planes(heights_m, half, least, resolution_m, slope_rad, roughness_m)
    index = np.rad2deg(slope_rad) * np.float32(params.slope_weight)
    index += roughness_m * np.float32(params.roughness_weight * math.sqrt(min(1.0, params.patch_m / across_m)))
    return Traversability(slope_rad, roughness_m, index, heights_m, resolution_m, params.untraversable_index)


def patch_reach(resolution_m: float, params: TraversabilityParams | None = None) -> int:
    """How many cells to each side a patch looks."""
    return max(1, round(((params or TraversabilityParams()).patch_m / resolution_m - 1.0) / 2.0))


def _check(elevation_m: NDArray[np.floating], resolution_m: float, params: TraversabilityParams) -> None:
    if elevation_m.ndim != 2 or elevation_m.size == 0:
        raise ParameterError(f"A grid of shape {elevation_m.shape} holds no ground.", where="elevation_m")
    if elevation_m.size > MOST_CELLS:
        coarser = resolution_m * math.sqrt(elevation_m.size / MOST_CELLS)
        raise CapacityError(
            f"{elevation_m.size:,} cells are more than the {MOST_CELLS:,} that are worked out at once.",
            where="resolution_m",
            advice=f"Choose a resolution of {math.ceil(coarser * 100) / 100:g} m or a smaller area.",
        )
    positive = (resolution_m, params.patch_m, params.untraversable_index)
    if not all(math.isfinite(number) and number > 0 for number in positive):
        raise ParameterError(f"Resolution, patch and index limit are {positive}.", advice="Give numbers above 0.")
    if not (params.slope_weight >= 0 and params.roughness_weight >= 0 and 0 < params.known_share <= 1):
        raise ParameterError(f"The weights or the share of {params} make no sense.", where="params")


@njit(cache=True, nogil=True)
def _fit_planes(heights_m, half, least, resolution_m, slope_rad, roughness_m):
    rows, cols = heights_m.shape
    full = (2 * half + 1) ** 2
    for r in range(rows):
        for c in range(cols):
            slope_rad[r, c] = np.nan
            roughness_m[r, c] = np.nan
            centre = heights_m[r, c]
            if not np.isfinite(centre):
                continue
            r0, r1 = max(0, r - half), min(rows, r + half + 1)
            c0, c1 = max(0, c - half), min(cols, c + half + 1)
            inside = (r1 - r0) * (c1 - c0)
            n, su, sv, sz = 0, 0.0, 0.0, 0.0
            suu, svv, suv, suz, svz, szz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(r0, r1):
                for j in range(c0, c1):
                    if not np.isfinite(heights_m[i, j]):
                        continue
                    # Counted from the cell itself: heights above sea level would eat the digits.
                    z = np.float64(heights_m[i, j]) - np.float64(centre)
                    u, v = float(j - c), float(i - r)
                    n += 1
                    su, sv, sz = su + u, sv + v, sz + z
                    suu, svv, suv = suu + u * u, svv + v * v, suv + u * v
                    suz, svz, szz = suz + u * z, svz + v * z, szz + z * z
            if n * full < least * inside or n < 4:
                continue
            muu, mvv, muv = suu - su * su / n, svv - sv * sv / n, suv - su * sv / n
            muz, mvz, mzz = suz - su * sz / n, svz - sv * sz / n, szz - sz * sz / n
            det = muu * mvv - muv * muv
            if det < 1e-9 * (muu + mvv) ** 2 or det <= 0.0:
                continue
            a, b = (muz * mvv - mvz * muv) / det, (mvz * muu - muz * muv) / det
            slope_rad[r, c] = math.atan(math.sqrt(a * a + b * b) / resolution_m)
            roughness_m[r, c] = math.sqrt(max(0.0, mzz - a * muz - b * mvz) / n)
