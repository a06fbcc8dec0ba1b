"""All that the camera has seen on its way, beside the local map of its last frame (Bigazzi 2022, fig. 5 b-c)."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.perceiving.frame_result import Settings
from mapping.voxels.map import VoxelMap


class FlightMap:
    """Bigazzi 2022, section 2.5: every frame goes in, nothing is taken out; as long as the camera's path holds.

    Where the path breaks off a new part begins, empty: what stands on two paths is nowhere laid together. Regions and
    alerts look into the local map alone. ``take`` is cheap and ``put_in`` is not: a frame is told before it.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.map = self._empty()
        self.part = 1
        self.why = ""
        """Of this part; empty for the first."""
        self.since_t_s = -math.inf
        self._waiting: tuple[F64, Bools | None] | None = None

    def take(self, centres: F64, explained: Bools | None) -> None:
        """A frame's voxels, (N, 3) and (N,), in the map's frame."""
        self._waiting = (centres, explained)

    def put_in(self) -> None:
        """What was taken last."""
        if self._waiting is not None:
            (centres, explained), self._waiting = self._waiting, None
            self.map.insert_hits(centres, explained=explained)  # Bigazzi 2022, fig. 5

    def begin_part(self, why: str, t_mono_s: float) -> None:
        """Nothing while nothing has been seen. Another map: what the one before held was seen, too."""
        self._waiting = None
        if self.map.voxel_count == 0:
            return
        self.map = self._empty()
        self.part, self.why, self.since_t_s = self.part + 1, why, t_mono_s

    def clear(self) -> None:
        self._waiting = None
        self.map.clear()

    def _empty(self) -> VoxelMap:
        limit = self._settings.memory_limit_bytes
        return VoxelMap(resolution_m=self._settings.resolution_m, memory_limit_bytes=limit)

    def move(self, rotation: F64, shift_m: F64) -> None:
        """The frame becomes known: p -> ``rotation`` (3, 3) @ p + ``shift_m`` (3,), as sure as before."""
        keys, probability, explained = self.map.known()
        if len(keys) == 0:
            return
        centres = self.map.centres(keys) @ rotation.T + shift_m
        log_odds = np.log(probability / (1.0 - probability))
        hits = np.rint(log_odds / log_odds.min()).astype(int)  # each voxel has been hit at least once
        self.map.clear()
        for number in range(1, int(hits.max()) + 1):
            again = hits >= number
            self.map.insert_hits(centres[again], explained=explained[again])
