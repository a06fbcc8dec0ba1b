"""Melita 2020, eq. 2, written slowly."""

import math

import numpy as np

from mapping.geometry.arrays import F32, F64, Bools
from planning.safe_surface.element import coarsest_block
from planning.safe_surface.surface import dilate
from planning.terrain.dsm import Dsm


def dilate_slowly(elevation_m: F32, *, radius_px: float, height_m: float) -> F64:
    """``max{A(x - x', y - y') + B(x', y')}`` cell by cell in float64; NaN where no known cell is within R."""
    rows, cols = elevation_m.shape
    reach = math.floor(radius_px)
    out_m = np.full((rows, cols), -math.inf)
    for y in range(rows):
        for x in range(cols):
            for y2 in range(max(0, y - reach), min(rows, y + reach + 1)):
                for x2 in range(max(0, x - reach), min(cols, x + reach + 1)):
                    r = math.hypot(y2 - y, x2 - x)
                    a = float(elevation_m[y2, x2])
                    if r <= radius_px and not math.isnan(a):
                        out_m[y, x] = max(out_m[y, x], a + height_m * math.sqrt(1 - (r / radius_px) ** 2))
    return np.where(np.isinf(out_m), math.nan, out_m)


def ball_structure(radius_px: float, height_m: float) -> tuple[Bools, F64]:
    """Footprint and heights of the ball as ``scipy.ndimage.grey_dilation`` takes them."""
    reach = math.floor(radius_px)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    ratio2 = (x**2 + y**2) / radius_px**2
    return ratio2 <= 1, height_m * np.sqrt(np.maximum(1 - ratio2, 0))


def dilate_fast(dsm: Dsm, *, radius_m: float, height_m: float) -> Dsm:
    """In the coarsest blocks that the bounds allow, each block's height on all of its cells."""
    block_px = coarsest_block(radius_m / dsm.resolution_m)
    rows, columns = dsm.elevation_m.shape
    coarse_m = dilate(dsm, radius_m=radius_m, height_m=height_m, block_px=block_px).elevation_m
    return dsm.with_elevation(coarse_m.repeat(block_px, axis=0)[:rows].repeat(block_px, axis=1)[:, :columns].copy())
