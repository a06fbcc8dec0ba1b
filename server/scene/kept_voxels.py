"""What a sensor had seen in this flight before its map began anew: it counts until the landing, or until it is emptied.

No map tells what it sees free and never saw hit, so nothing of this is freed by looking there again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mapping.geometry.arrays import I64
from telemetry.topics.obstacles import MapOrigin

Grid = tuple[MapOrigin, float]
"""Origin of a map frame, and the edge of its voxels in metres."""

MOST_VOXELS = 4_000_000
"""32 MB."""


@dataclass(slots=True)
class Kept:
    """Occupied voxels that the surface model does not explain, by number ((N,) sorted), for each grid."""

    grids: dict[Grid, I64] = field(default_factory=dict)
    is_over_full: bool = False
    """Some found no room, or never came: nobody knows any more all that was seen."""

    @property
    def voxel_count(self) -> int:
        return sum(len(ids) for ids in self.grids.values())

    def keep(self, grid: Grid, ids: I64) -> None:
        """Maps of one grid are one."""
        if not len(ids):
            return
        before = self.grids.get(grid, np.zeros(0, np.int64))
        both = np.sort(np.concatenate([before, ids]))  # of millions, faster than np.union1d
        kept = both[np.diff(both, prepend=both[0] - 1) > 0]
        if self.voxel_count - len(before) + len(kept) > MOST_VOXELS:
            self.is_over_full = True
        else:
            self.grids[grid] = kept

    def forget(self) -> None:
        self.grids.clear()
        self.is_over_full = False
