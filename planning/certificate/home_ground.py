"""The ground under a vehicle that starts or lands at a place: what it may stand on, and whether it gets up from there.

The vehicle's centre is within ``centre_m`` of the place, its hull within ``radius_m`` of its centre. Every cell
within both together must be known, and the lowest and highest of them bound the height it may really stand at.

Two cells within the hull's reach of each other may differ by 1 m, which stands beside or under a vehicle's legs
(grass, a bush, stones, a kerb), or by what a slope of 35 degrees rises from one's middle to the other's, whichever
is more. Any plane slope up to 35 degrees passes at any resolution; a wall, a mast or a tree does not, wherever in
reach it begins, nor does what stands on the ground and has the place on its top: a spike, a boulder, a crown, a
roof's edge. The rule knows no cell of reference: a place passes whenever a larger ``centre_m`` around a place nearby
does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64
from planning.certificate.around import CellsAround, cells_around
from planning.terrain.dsm import Dsm

FREE_STEP_M = 1.0
FREE_SLOPE = math.tan(math.radians(35.0))
_ROUNDING_M = 1e-4
"""Of float32 elevations some kilometres high."""
_TILES_PER_RADIUS = 4


@dataclass(frozen=True, slots=True)
class HomeGround:
    """The surface model around a place where a vehicle stands."""

    alt_dsm_m: float
    """Of the place's own cell; NaN where unknown or outside."""
    low_dsm_m: float
    """Of the cells in reach; NaN when one of them is unknown."""
    high_dsm_m: float
    reach_m: float
    obstacle: str | None
    """Why no vehicle can start there, in words that go on from "the column is not clear:"; None: it can."""
    on_top: bool = False
    """The obstacle is what the place itself lies on."""


def home_ground(
    dsm: Dsm, xy_m: tuple[float, float], *, centre_m: float, radius_m: float, stands_dsm_m: float | None = None
) -> HomeGround:
    """The ground around the projected place ``xy_m``.

    ``stands_dsm_m``: the vehicle is known to stand so high, and only what rises above that is in its way. Where the
    model's heights are raised for their error, what rises above the ground that they show there is, too.
    Where several models meet, a step may be as large as they are apart.
    """
    reach_m, alt_m = centre_m + radius_m, float(dsm.elevation_at(np.array([xy_m]))[0])
    around = cells_around(dsm.cells, xy_m, reach_m)
    if not around.inside:
        return _unknown(alt_m, reach_m, f"the surface model ends within {reach_m:.2f} m")
    reached = around.height_m[around.near_m <= reach_m]
    if not np.isfinite(reached).all():
        return _unknown(alt_m, reach_m, f"the surface model has unknown cells within {reach_m:.2f} m")
    lowest_m = around.height_m if dsm.lowest_m is None else dsm.lowest_m[around.block].astype(np.float64)
    words, on_top = None, False
    if stands_dsm_m is not None:
        words = _risen(around, reach_m, stands_dsm_m)
    if stands_dsm_m is None or (words is not None and dsm.lowest_m is not None):
        words, on_top = _uneven(dsm, around, lowest_m, alt_m, centre_m, radius_m)
        if words is None and stands_dsm_m is not None:
            gap_m = float((around.height_m - lowest_m)[around.near_m <= 0.0].min())
            words = _risen(around, reach_m, stands_dsm_m + gap_m)
    low_m = float(lowest_m[around.near_m <= reach_m].min())
    return HomeGround(alt_m, low_m, float(reached.max()), reach_m, words, on_top)


def _uneven(
    dsm: Dsm, around: CellsAround, lowest_m: F64, alt_m: float, centre_m: float, radius_m: float
) -> tuple[str | None, bool]:
    """What is too steep around a place, in words, and whether the place lies on top of it."""
    lattice, reach_m = dsm.cells.layout.lattice, centre_m + radius_m
    sides = (float(lattice.height_m), float(lattice.width_m), float(lattice.shear_m))
    highest_m, near_m = around.height_m, around.near_m
    steep = _steep(highest_m, highest_m, near_m, *sides, centre_m, reach_m, radius_m)
    words, on_top = _obstacle(around, alt_m, *steep)
    if words is None and dsm.seam is not None and (seam := dsm.seam[around.block] & (near_m <= reach_m)).any():
        ends = highest_m, np.where(seam, lowest_m, highest_m)
        high_m, low_m = _steep(*ends, near_m, *sides, centre_m, reach_m, radius_m)
        if high_m > low_m:
            words = f"the surface models that meet here leave {high_m - low_m:.1f} m open, their errors included"
    return words, on_top


def _unknown(alt_m: float, reach_m: float, words: str) -> HomeGround:
    return HomeGround(alt_m, math.nan, math.nan, reach_m, words)


def _risen(around: CellsAround, reach_m: float, stands_dsm_m: float) -> str | None:
    """The highest cell that rises too much above where the vehicle stands, in words."""
    rise_m = around.height_m - stands_dsm_m
    free_m = np.maximum(FREE_STEP_M, FREE_SLOPE * around.far_m) + _ROUNDING_M
    blocked = (around.near_m <= reach_m) & (rise_m > free_m)
    if not blocked.any():
        return None
    worst = np.unravel_index(np.argmax(np.where(blocked, rise_m, -np.inf)), rise_m.shape)
    return f"the surface rises {rise_m[worst]:.1f} m at {around.near_m[worst]:.1f} m from it"


def _obstacle(around: CellsAround, alt_m: float, high_m: float, low_m: float) -> tuple[str | None, bool]:
    """What the steepest pairs' highest and lowest cells are to the place; None when there is no such pair."""
    if high_m < low_m:
        return None, False
    rise_m, fall_m = high_m - alt_m, alt_m - low_m
    on_top = fall_m > rise_m
    away_m = float(around.near_m[around.height_m == (low_m if on_top else high_m)].min())
    verb, step_m = ("falls", fall_m) if on_top else ("rises", rise_m)
    return f"the surface {verb} {step_m:.1f} m at {away_m:.1f} m from it", on_top


@njit(cache=True, nogil=True)
def free_step_m(rows, cols, high, wide, lean):
    """By how much cells so many rows and columns apart may differ.

    Each is ``high`` by ``wide`` metres, and every row is moved by ``lean`` against the one before.
    """
    return max(FREE_STEP_M, FREE_SLOPE * math.hypot(rows * high, cols * wide + rows * lean)) + _ROUNDING_M


@njit(cache=True, nogil=True)
def gap_m(rows, cols, high, wide, lean):
    """Distance between the nearest points of cells so many rows and columns apart; of leaning ones, at least."""
    across = wide * max(0, abs(cols) - 1)
    if lean != 0.0:
        across = max(0.0, abs(cols * wide + rows * lean) - wide - abs(lean))
    return math.hypot(high * max(0, abs(rows) - 1), across)


@njit(cache=True, nogil=True)
def _tile_ranges(tops, feet, near_m, reach_m, tile):
    """Highest and lowest reached cell of each square of ``tile`` cells; -inf and inf where none is reached."""
    shape = ((tops.shape[0] + tile - 1) // tile, (tops.shape[1] + tile - 1) // tile)
    high, low = np.full(shape, -np.inf), np.full(shape, np.inf)
    for r in range(tops.shape[0]):
        for c in range(tops.shape[1]):
            if near_m[r, c] <= reach_m:
                i, j = r // tile, c // tile
                high[i, j] = max(high[i, j], tops[r, c])
                low[i, j] = min(low[i, j], feet[r, c])
    return high, low


@njit(cache=True, nogil=True)
def _steep_between(tops, feet, near_m, tall, wide, lean, centre_m, reach_m, radius_m, tile, i, j, p, q, high, low):
    """Highest top and lowest foot of the pairs too steep, the first in tile (i, j), the second in (p, q)."""
    for r in range(i * tile, min(tops.shape[0], (i + 1) * tile)):
        for c in range(j * tile, min(tops.shape[1], (j + 1) * tile)):
            if near_m[r, c] > centre_m:
                continue
            for s in range(p * tile, min(tops.shape[0], (p + 1) * tile)):
                for d in range(q * tile, min(tops.shape[1], (q + 1) * tile)):
                    if near_m[s, d] > reach_m or gap_m(s - r, d - c, tall, wide, lean) > radius_m:
                        continue
                    free = free_step_m(s - r, d - c, tall, wide, lean)
                    if tops[s, d] - feet[r, c] > free:
                        high, low = max(high, tops[s, d]), min(low, feet[r, c])
                    if tops[r, c] - feet[s, d] > free:
                        high, low = max(high, tops[r, c]), min(low, feet[s, d])
    return high, low


@njit(cache=True, nogil=True)
def _steep(tops, feet, near_m, tall, wide, lean, centre_m, reach_m, radius_m):
    """Highest top and lowest foot of all pairs of cells that are too steep; (-inf, inf) when there is none.

    A cell's surface lies between its foot and its top, which are the same where one model alone tells it.
    Squares of cells that differ by no more than is free anyway are passed over together.
    """
    side = min(tall, wide)
    tile = max(1, int(radius_m / side / _TILES_PER_RADIUS))
    tile_high, tile_low = _tile_ranges(tops, feet, near_m, reach_m, tile)
    leaning_m = (radius_m / tall + 2.0) * abs(lean)
    around = math.ceil((radius_m + leaning_m) / (tile * side)) + 1
    high, low = -np.inf, np.inf
    for i in range(tile_high.shape[0]):
        for j in range(tile_high.shape[1]):
            for p in range(max(0, i - around), min(tile_high.shape[0], i + around + 1)):
                for q in range(max(0, j - around), min(tile_high.shape[1], j + around + 1)):
                    most = max(tile_high[p, q] - tile_low[i, j], tile_high[i, j] - tile_low[p, q])
                    if most > FREE_STEP_M:
                        high, low = _steep_between(
                            tops, feet, near_m, tall, wide, lean, centre_m, reach_m, radius_m, tile, i, j, p, q,
                            high, low,
                        )  # fmt: skip
    return high, low
