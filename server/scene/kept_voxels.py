"""What a sensor had seen in this flight before its map began anew: it still stands there until somebody has looked."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mapping.geometry.arrays import I64
from telemetry.topics.obstacles import MapOrigin

Grid = tuple[MapOrigin, float]
"""Origin of a map frame, and the edge of its voxels in metres."""

MOST_GRIDS, MOST_VOXELS = 16, 4_000_000


@dataclass(slots=True)
class Kept:
    """Occupied voxels that the surface model does not explain, by number ((N,) sorted), for each grid."""

    grids: dict[Grid, I64] = field(default_factory=dict)
    is_over_full: bool = False
    """Some found no room: nobody knows any more all that was seen."""

    @property
    def voxel_count(self) -> int:
        return sum(len(ids) for ids in self.grids.values())

    def keep(self, grid: Grid, ids: I64) -> None:
        if not len(ids):
            return
        kept = np.union1d(self.grids[grid], ids) if grid in self.grids else np.unique(ids)
        others = self.voxel_count - len(self.grids.get(grid, ()))
        if others + len(kept) > MOST_VOXELS or (grid not in self.grids and len(self.grids) >= MOST_GRIDS):
            self.is_over_full = True
            return
        self.grids[grid] = kept

    def seen_again(self, grid: Grid, ids: I64) -> None:
        """These were seen free, or are known ground."""
        if (kept := self.grids.get(grid)) is None or not len(ids):
            return
        if len(left := np.setdiff1d(kept, ids, assume_unique=False)):
            self.grids[grid] = left
        else:
            del self.grids[grid]

    def forget(self) -> None:
        self.grids.clear()
        self.is_over_full = False
