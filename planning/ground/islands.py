"""Level ground that stands above everything around it and that nothing walkable leads to: roofs, hedges, tree tops."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from scipy import ndimage

from mapping.geometry.arrays import F64, I32, Bools
from mapping.traversability import Traversability

GROUND_M2 = 10_000.0
"""A connected region this large is ground: few roofs are, and a plateau or an isle in a lake is no roof."""
RING_M = 15.0
"""So far around a region its surroundings are looked at."""
HIGH_M = 1.0
"""What counts as lower, beyond the slope of walkable ground."""
WALKABLE_RAD = math.radians(10.0)
RIM_SHARE = 0.6
"""Of its outline, with something lower outside. A terrace on a slope has its lower half."""
NOTCH_M = 3.0
"""Narrower gaps belong to a region: chimneys and vents leave ragged what is traversable of a roof."""
LONGEST_M = 150.0
"""From the place in question: how much of a region is looked at. No roof below ``GROUND_M2`` is much longer."""


class Islands:
    """Regions of traversable cells, connected by more than one cell's breadth, each judged once when first asked for.

    A single cell of noise across a roof's edge is no path: cells count that have traversable neighbours on all sides.
    """

    def __init__(self, traversability: Traversability) -> None:
        self._map = traversability
        walkable = traversability.index < traversability.untraversable_index
        broad = ndimage.binary_erosion(walkable, np.ones((3, 3)), border_value=1)
        self.regions: I32 = _labelled(np.asarray(broad, np.bool_))
        """(rows, cols), from 1; 0 belongs to none."""
        self._cells = np.bincount(self.regions.ravel())
        self._boxes = ndimage.find_objects(self.regions)
        self._high: dict[int, bool] = {}

    def region(self, row: int, col: int) -> int:
        """Of a cell or of one beside it; 0 for a spot too small to be one."""
        return int(self.regions[max(0, row - 1) : row + 2, max(0, col - 1) : col + 2].max())

    def stands_high(self, row: int, col: int) -> bool:
        """Whether the cell's region looks like a roof or a crown; a spot without a region does."""
        region = self.region(row, col)
        if region == 0:
            return True
        if self._cells[region] * self._map.resolution_m**2 >= GROUND_M2:
            return False
        if region not in self._high:
            self._high[region] = self._share_above(region, row, col) > RIM_SHARE
        return self._high[region]

    def _share_above(self, region: int, row: int, col: int) -> float:
        """Of the region's outline, seen from outside: with something lower in front of it.

        What lies beyond the map or is unknown is not lower.
        """
        cell_m = self._map.resolution_m
        cut = self._around(region, row, col)
        inside = _smooth(self.regions[cut] == region, NOTCH_M / 2.0 / cell_m)
        found = cast("tuple[F64, I32]", ndimage.distance_transform_edt(~inside, return_indices=True))
        away, (near_row, near_col) = found
        height_m = self._map.elevation_m[cut].astype(np.float64)
        drop_m = height_m[near_row, near_col] - height_m - away * cell_m * math.tan(WALKABLE_RAD)
        lower = ~inside & (away * cell_m <= RING_M) & (drop_m > HIGH_M)
        above = np.zeros_like(inside)
        above[near_row[lower], near_col[lower]] = True
        # On slanting outlines no cell is nearest to some of the rim: neighbours share what they see.
        above = np.asarray(ndimage.maximum_filter(above, size=5), np.bool_)
        rim = inside & ~np.asarray(ndimage.binary_erosion(inside), np.bool_)
        return float((above & rim).sum() / rim.sum())

    def _around(self, region: int, row: int, col: int) -> tuple[slice, slice]:
        """The region, as far as it is looked at, and its surroundings."""
        ring, longest = (math.ceil(length_m / self._map.resolution_m) for length_m in (RING_M, LONGEST_M))
        rows, cols = (
            slice(max(0, box.start - ring, at - longest), min(size, box.stop + ring, at + longest + 1))
            for box, at, size in zip(self._boxes[region - 1], (row, col), self.regions.shape, strict=True)
        )
        return rows, cols


def _labelled(mask: Bools) -> I32:
    labels = np.empty(mask.shape, np.int32)
    ndimage.label(mask, output=labels)
    return labels


def _smooth(inside: Bools, radius_px: float) -> Bools:
    """Without notches, closed with a disc, and without holes: what an outline encloses belongs to it."""
    rim = math.ceil(radius_px) + 1
    near = np.asarray(ndimage.distance_transform_edt(~np.pad(inside, rim))) <= radius_px
    closed = np.asarray(ndimage.distance_transform_edt(near)) > radius_px
    parts = _labelled(~closed)
    return (parts != parts[0, 0])[rim:-rim, rim:-rim]
