"""The ball of Melita 2020, eq. 2, as weights per row and column offset, and how coarse it may be.

Fast form. Source and target are cut into blocks of b x b cells; a source block counts as its highest
cell, a target block gets one height, and the ball is taken at the SMALLEST distance between any two
of their cells. It is therefore nowhere below eq. 2. True distances exceed that smallest one by at most
2 (b - 1) cells along each axis, so the result is what eq. 2 gives with the ball's body swept
over a horizontal disc of 2 sqrt(2) (b - 1) cells. A convex body K fulfils 1.05 K = K + 0.05 K, so as long as
that disc, thickened by the rounding allowance, fits into 0.05 K, the result is nowhere above eq. 2 with
(1.05 R, 1.05 H). The work falls with b to the fourth power.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F32, I64
from planning.safe_surface.kernel import PAIRS, UNKNOWN

EXCESS = 0.05
"""The fast form stays under eq. 2 with (1.05 R, 1.05 H)."""
_DISC_SHARE = 0.995
"""Part of 0.05 R that the blocks may use; leaves 0.05 H sqrt(1 - 0.995^2), 0.5 % of H, for rounding."""
_ROUNDING_SHARE = 0.0025
_RIM = 1 + 1e-9
"""R / resolution is rarely exact in binary; a cell that lies on the rim on paper belongs to the ball."""


@dataclass(frozen=True, slots=True)
class Element:
    """One quadrant of a structuring element that is symmetric in rows and columns."""

    weights_m: F32
    """(D, P) height at row offset d and column offset p; ``UNKNOWN`` outside."""
    pairs: I64
    """(D,) columns to visit in each row, a multiple of ``PAIRS``."""


def ball(*, radius_px: float, height_m: float, block_px: int = 1, lift_m: float = 0.0) -> Element:
    """The upper half of the ellipsoid (R, H), ``H sqrt(1 - (r / R)^2)`` for r <= R (Melita 2020, eq. 2).

    With ``block_px`` b > 1 offsets count blocks and r is the smallest distance between their cells.
    ``lift_m`` is added to cover float32 rounding of the sums.
    """
    reach = ball_reach(radius_px, block_px)
    offset_px = np.maximum(np.arange(reach + 1) * block_px - (block_px - 1), 0).astype(np.float64)
    ratio2 = (offset_px[:, None] ** 2 + offset_px[None, :] ** 2) / radius_px**2
    inside = ratio2 <= _RIM**2
    pairs = -(-inside.sum(axis=1) // PAIRS) * PAIRS
    weights_m = np.full((reach + 1, int(pairs.max())), UNKNOWN, np.float32)
    height = height_m * np.sqrt(np.maximum(1 - ratio2, 0)) + lift_m  # Melita 2020, eq. 2
    weights_m[:, : reach + 1][inside] = height[inside]
    return Element(weights_m, pairs.astype(np.int64))


def ball_reach(radius_px: float, block_px: int = 1) -> int:
    """How many blocks of cells to each side the ball looks."""
    return math.floor((radius_px * _RIM + block_px - 1) / block_px)


def coarsest_block(radius_px: float) -> int:
    """The largest block side in cells that keeps the fast form under eq. 2 with (1.05 R, 1.05 H)."""
    return 1 + math.floor(_DISC_SHARE * EXCESS * radius_px / (2 * math.sqrt(2)))


def finest_block(shape: tuple[int, int], radius_px: float, max_work: float) -> int:
    """The smallest block side whose work fits ``max_work``, or the coarsest allowed; 1 is the exact form."""
    coarsest = coarsest_block(radius_px)
    return next((b for b in range(1, coarsest) if work(shape, radius_px, b) <= max_work), coarsest)


def work(shape: tuple[int, int], radius_px: float, block_px: int) -> float:
    """Cells of the target times cells of the element."""
    return shape[0] * shape[1] / block_px**2 * math.pi * ((radius_px + block_px - 1) / block_px) ** 2


def rounding_lift_m(elevation_m: F32, height_m: float) -> float:
    """What the fast form adds so that float32 rounding never takes it below eq. 2: two units in the last place."""
    highest = float(np.nanmax(np.abs(elevation_m), initial=0.0))
    return min(2 * float(np.spacing(np.float32(highest + height_m))), _ROUNDING_SHARE * height_m)
