"""Gaussian smoothing that neither spreads unknown cells nor lets them weigh."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from mapping.geometry.arrays import F32

TRUNCATE_SIGMA = 4.0
"""The kernel ends here; the tails left out weigh 6e-5."""

_LEAST_SIGMA_PX = 0.1
"""Below it the next cell weighs less than exp(-50)."""


def reach_px(sigma_px: float) -> int:
    """How many cells to each side the kernel looks."""
    return math.ceil(TRUNCATE_SIGMA * sigma_px)


def gaussian_grid(height_m: F32, sigma_px: float) -> F32:
    """Normalised Gaussian mean of the known cells around each known cell (H, W); NaN stays NaN.

    Cells outside the grid count as unknown, so the mean is not drawn to any made-up height there.
    """
    known = ~np.isnan(height_m)
    if sigma_px < _LEAST_SIGMA_PX or not known.any():
        return height_m.copy()
    half = _half_kernel(sigma_px)
    base = np.nanmin(height_m)  # float32 sums over the relief only: exact enough at any altitude
    total = _blur(np.where(known, height_m - base, np.float32(0)), half)
    weight = _all_known_weight(height_m.shape, half) if known.all() else _blur(known.astype(np.float32), half)
    return np.where(known, total / np.where(known, weight, np.float32(1)) + base, np.float32(np.nan))


def _half_kernel(sigma_px: float) -> F32:
    half = np.exp(-0.5 * (np.arange(reach_px(sigma_px) + 1) / sigma_px) ** 2)
    return (half / (2 * half.sum() - half[0])).astype(np.float32)


def _all_known_weight(shape: tuple[int, int], half: F32) -> F32:
    """What blurring a grid of ones gives: short of 1 only near the edges, and separable."""
    rows, cols = (_blur(np.ones((n, 1), np.float32), half)[:, 0] / half[0] for n in shape)
    return rows[:, None] * cols[None, :]


def _blur(grid: F32, half: F32) -> F32:
    return _blur_along_rows(_blur_across_rows(grid, half), half)


@njit(cache=True, nogil=True, parallel=True)
def _blur_across_rows(grid: F32, half: F32) -> F32:
    height, width = grid.shape
    out = np.empty((height, width), np.float32)
    for r in prange(height):
        sums = out[r]
        sums[:] = half[0] * grid[r]
        for k in range(1, half.size):
            if r - k >= 0:
                _add_scaled(sums, grid[r - k], half[k])
            if r + k < height:
                _add_scaled(sums, grid[r + k], half[k])
    return out


@njit(cache=True, nogil=True, parallel=True)
def _blur_along_rows(grid: F32, half: F32) -> F32:
    height, width = grid.shape
    out = np.empty((height, width), np.float32)
    for r in prange(height):
        sums, row = out[r], grid[r]
        sums[:] = half[0] * row
        for k in range(1, min(half.size, width)):
            _add_scaled(sums[k:], row[: width - k], half[k])
            _add_scaled(sums[: width - k], row[k:], half[k])
    return out


@njit(cache=True, nogil=True)
def _add_scaled(sums: F32, values: F32, factor: np.float32) -> None:
    for i in range(sums.size):
        sums[i] += factor * values[i]
