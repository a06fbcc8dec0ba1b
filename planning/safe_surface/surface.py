"""From the surface model to the safe surface a drone may fly on (Melita 2020, section 5)."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
from affine import Affine
from numba import njit, prange

from mapping.geometry.arrays import F32, F64
from planning.basics.plan_model import SurfaceParams, Surfaces
from planning.errors import ParameterError
from planning.safe_surface.element import ball, ball_reach, coarsest_block, finest_block, rounding_lift_m
from planning.safe_surface.kernel import dilate_grid
from planning.safe_surface.smooth import gaussian_grid, reach_px
from planning.safe_surface.window import Box
from planning.terrain.dsm import Dsm, SurfaceModel

FLOOR_SHARE = 0.8
"""The smoothed surface stays above the model dilated with (R, 0.8 H)."""
AUTO_WORK = 6e9
"""Cells times element cells that "auto" spends on one dilation: about 0.07 s on two cores of a 2024 server."""


def block_max(dsm: Dsm, factor: int) -> Dsm:
    """Downsample by the MAXIMUM over factor x factor cells, so that a mast of one cell survives.

    Unknown cells count only where a whole block is unknown. Blocks at the right and lower edge may hang
    over it. Raises ParameterError for a factor below 1.
    """
    if factor < 1:
        raise ParameterError(f"The downsampling factor is {factor}.", advice="Use a whole number from 1 upwards.")
    if factor == 1:
        return dsm
    return replace(
        dsm.as_grid(),
        elevation_m=block_max_grid(dsm.elevation_m, factor),
        transform=dsm.transform @ Affine.scale(factor),
    )


def fit_within(dsm: Dsm, max_px: int) -> Dsm:
    """The model, block maxima taken until it is at most ``max_px`` wide and high: for drawing."""
    return block_max(dsm, max(1, math.ceil(max(dsm.height_px, dsm.width_px) / max_px)))


def dilate(dsm: Dsm, *, radius_m: float, height_m: float, block_px: int = 1) -> Dsm:
    """Grey dilation with the upper half of an ellipsoid of radius R and height H (Melita 2020, eq. 2).

    ``(A + B)(x, y) = max{A(x - x', y - y') + B(x', y')}``, ``B(r) = H sqrt(1 - (r / R)^2)`` for r <= R.
    Unknown cells and everything outside the model are -inf; a cell with no known cell within R is NaN.

    That costs (R / resolution)^2 per cell. With blocks of ``block_px`` cells, one height each, it costs less: in blocks
    of ``coarsest_block`` and finer it is nowhere below eq. 2 with (R, H) and nowhere above eq. 2 with (1.05 R, 1.05 H).
    """
    coarse = block_max(dsm, block_px)
    highest_m = np.ascontiguousarray(coarse.elevation_m)
    highest_m.flags.writeable = False  # one compiled variant of the kernel serves copies and originals
    lift_m = rounding_lift_m(highest_m, height_m) if block_px > 1 else 0.0
    element = ball(radius_px=radius_m / dsm.resolution_m, height_m=height_m, block_px=block_px, lift_m=lift_m)
    return coarse.with_elevation(dilate_grid(highest_m, element.weights_m, element.pairs))


def dilate_part(model: SurfaceModel, box: Box, *, radius_m: float, height_m: float) -> F32:
    """(rows, columns) of a box of ``dilate`` over the whole model, bit for bit: the box and R around it are looked at.

    Each cell's sums are the same ones, rounded alike, and the largest of them does not depend on their order.
    """
    outer = box.grown(ball_reach(radius_m / model.resolution_m), (model.height_px, model.width_px))
    part = dilate(outer.cut(model).as_grid(), radius_m=radius_m, height_m=height_m)
    return box.relative_to(outer, 1).cut(part).elevation_m


def safe_surface(dsm: Dsm, params: SurfaceParams, *, around_xy_m: F64 | None = None, margin_m: float = 2.0) -> Surfaces:
    """The surface to fly on: dilate, smooth, keep above the floor (Melita 2020, section 5); small holes were filled.

    With ``around_xy_m`` (N, 2), projected metres, only their bounding box and ``margin_m`` around it is
    computed and returned, with heights as good as the whole model gives there. "auto" takes the finest
    blocks of cells that stay within `AUTO_WORK`, "fast" the coarsest that the bounds of `dilate` allow; both
    surfaces then have one cell per block. The floor, our addition, is the model dilated with (R, 0.8 H):
    the Gaussian alone (``floor=False``, the paper's pipeline) sinks lower over ridges and masts.
    Raises ParameterError for R, H, sigma or points that make no sense on this model.
    """
    check_ball(dsm, params.radius_m, params.height_m)
    sigma_m = params.radius_m / 10 if params.smooth_sigma_m is None else params.smooth_sigma_m
    _check_sigma(sigma_m)
    inner = Box.of(dsm) if around_xy_m is None else Box.around(dsm, around_xy_m, margin_m)
    block_px, outer = _extent(dsm, params, sigma_m, inner)
    part = outer.cut(dsm.as_grid())
    safe = dilate(part, radius_m=params.radius_m, height_m=params.height_m, block_px=block_px)
    safe = safe.with_elevation(gaussian_grid(safe.elevation_m, sigma_m / safe.resolution_m))  # Melita 2020, fig. 6
    floor = None
    if params.floor:
        low_m = FLOOR_SHARE * params.height_m
        floor = dilate(part, radius_m=params.radius_m, height_m=low_m, block_px=block_px)
        safe = safe.with_elevation(np.maximum(safe.elevation_m, floor.elevation_m))
        floor = inner.relative_to(outer, block_px).cut(floor)
    safe = inner.relative_to(outer, block_px).cut(safe)
    return Surfaces(safe, "exact" if block_px == 1 else "fast", floor)


def safe_surface_at(surfaces: Surfaces, xy_m: F64) -> F64:
    """Height of the safe surface at projected points (N, 2), bilinear between cell centres; NaN where unknown.

    Interpolation may dip below the cell that holds a point, so the floor's cell bounds it from below: at
    every point the result is at least the model dilated with (R, 0.8 H). Unknown neighbours do not weigh.
    """
    alt_dsm_m = _bilinear(surfaces.safe, xy_m)
    return alt_dsm_m if surfaces.floor is None else np.maximum(alt_dsm_m, surfaces.floor.elevation_at(xy_m))


def _bilinear(dsm: Dsm, xy_m: F64) -> F64:
    row_f, col_f = (f - 0.5 for f in dsm.fractional_cell(xy_m))
    total, weight = np.zeros(row_f.shape), np.zeros(row_f.shape)
    unknown = np.isnan(dsm.elevation_at(xy_m))
    row_f[unknown] = col_f[unknown] = 0.0
    for row, col in itertools.product((np.floor(row_f), np.floor(row_f) + 1), (np.floor(col_f), np.floor(col_f) + 1)):
        r = np.clip(row, 0, dsm.height_px - 1).astype(np.intp)
        c = np.clip(col, 0, dsm.width_px - 1).astype(np.intp)
        corner_m = dsm.elevation_m[r, c].astype(np.float64)
        share = np.where(np.isnan(corner_m), 0.0, (1 - np.abs(row_f - row)) * (1 - np.abs(col_f - col)))
        total += share * np.nan_to_num(corner_m, nan=0.0)
        weight += share
    weight[unknown] = np.nan
    return total / weight


def _extent(dsm: Dsm, params: SurfaceParams, sigma_m: float, inner: Box) -> tuple[int, Box]:
    """Block side, and the box whose cells can be felt inside ``inner`` through ball and Gaussian."""
    radius_px, sigma_px = params.radius_m / dsm.resolution_m, sigma_m / dsm.resolution_m
    halo_px = math.ceil(radius_px) + reach_px(sigma_px)
    block_px = 1
    if params.method == "fast":
        block_px = coarsest_block(radius_px)
    elif params.method == "auto":
        block_px = finest_block(inner.grown(halo_px, dsm.elevation_m.shape).shape, radius_px, AUTO_WORK)
    # Blocks round the ball, the Gaussian and the cut outwards by up to one block each.
    return block_px, inner.grown(halo_px + 4 * block_px, dsm.elevation_m.shape)


def check_ball(dsm: SurfaceModel, radius_m: float, height_m: float) -> None:
    """Raises ParameterError for R or H that make no sense on this model."""
    for name, value in (("radius", radius_m), ("height", height_m)):
        if not (math.isfinite(value) and value > 0):
            raise ParameterError(
                f"The dilation {name} is {value:g} m.", advice="Give a finite number of metres above zero."
            )
    side_m = min(dsm.height_px, dsm.width_px) * dsm.resolution_m
    if radius_m > side_m:
        raise ParameterError(
            f"The dilation radius of {radius_m:g} m is larger than the surface model's shorter side, {side_m:g} m.",
            advice="Choose a smaller radius or a larger surface model.",
        )


def _check_sigma(sigma_m: float) -> None:
    if not (math.isfinite(sigma_m) and sigma_m >= 0):
        raise ParameterError(
            f"The smoothing sigma is {sigma_m:g} m.", advice="Give 0 for none or a positive number of metres."
        )


@njit(cache=True, nogil=True, parallel=True)
def block_max_grid(source_m: F32, block_px: int) -> F32:
    """Highest known cell of each block of b x b cells; NaN where a block holds none.

    source_m: (H, W) float32, any layout. Returns (ceil(H / b), ceil(W / b)); blocks at the right and
    lower edge may be partial. Reads the source once and needs one row of memory per thread.
    """
    height, width = source_m.shape
    rows, cols = (height + block_px - 1) // block_px, (width + block_px - 1) // block_px
    out_m = np.empty((rows, cols), np.float32)
    for br in prange(rows):
        highest_m = np.full(cols * block_px, -np.inf, np.float32)
        for r in range(br * block_px, min(height, (br + 1) * block_px)):
            row = source_m[r]
            for c in range(width):
                # An ordered comparison is false for NaN: unknown cells drop out.
                highest_m[c] = row[c] if row[c] > highest_m[c] else highest_m[c]
        for bc in range(cols):
            best = np.float32(-np.inf)
            for v in highest_m[bc * block_px : (bc + 1) * block_px]:
                best = v if v > best else best
            out_m[br, bc] = best if best > -np.inf else np.nan
    return out_m
