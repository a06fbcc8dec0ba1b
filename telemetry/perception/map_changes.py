"""What of a map has not been told yet, as messages, and how fast they are sent."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import U8
from mapping.voxels.map import VoxelMap
from telemetry.topics.deltas import in_parts
from telemetry.topics.obstacles import MapDelta, MapName, MapOrigin

_NEVER = -1
AT_ONCE = 2
BETWEEN_S = 0.02
LEAST_APART_S = 1e-3
"""Of two beginnings of a map."""
MOST_PARTS = 400
"""Eight million voxels. When so many wait, something is wrong, and the map is told whole instead."""


class ChangeTeller:
    """Of one map, which may be exchanged for a new one at any time: then that is told whole."""

    def __init__(self, name: MapName, utc_minus_mono_s: float) -> None:
        self._name: MapName = name
        self._utc_minus_mono_s = utc_minus_mono_s
        self._map: VoxelMap | None = None
        self._origin: MapOrigin | None = None
        self._told = _NEVER
        self._began_mono_s = 0.0
        self._clear_count = 0

    def forget(self) -> None:
        """The next time the whole map is told."""
        self._told = _NEVER

    def changes(
        self, the_map: VoxelMap, origin: MapOrigin | None, t_mono_s: float, clear_count: int = 0
    ) -> list[MapDelta]:
        """Nothing while nothing has changed, or nobody knows where the map lies. ``clear_count``: of the settings that
        the map was made by; for another one it is told whole, as whoever gave that order has passed over what was told
        before."""
        if origin is None:
            return []
        if the_map is not self._map or origin != self._origin:
            self._map, self._origin, self._told = the_map, origin, _NEVER
            # No beginning has the time of another one.
            self._began_mono_s = max(t_mono_s, self._began_mono_s + LEAST_APART_S)
        if clear_count != self._clear_count:
            self._clear_count, self._told = clear_count, _NEVER
        if the_map.revision == self._told:
            return []
        found = the_map.changed_since(self._told, ever_hit_only=True)
        since, self._told = self._told, found.revision
        # Of a whole map free space need not be told: what is not named is not there.
        keep = found.probability > 0.5 if found.whole else np.ones(len(found.keys), np.bool_)
        if not found.whole and not keep.any():
            return []
        kept = np.flatnonzero(keep)
        kept = kept[np.lexsort(found.keys[kept].T[::-1])]  # neighbours beside each other: half as large on disk
        head = self._head(found.whole, found.revision, max(since, 0), origin, the_map.resolution_m, t_mono_s)
        return in_parts(
            head, found.keys[kept], told_probability(found.probability[kept]), found.explained[kept].astype(np.uint8)
        )

    def _head(
        self, whole: bool, revision: int, since: int, origin: MapOrigin, resolution_m: float, t_mono_s: float
    ) -> MapDelta:
        return MapDelta(
            sensor=self._name,
            t_mono_s=t_mono_s,
            t_utc_s=t_mono_s + self._utc_minus_mono_s,
            revision=revision,
            whole=whole,
            part=0,
            parts=1,
            origin=origin,
            resolution_m=resolution_m,
            keys=b"",
            probability=b"",
            explained=b"",
            since=since,
            began_mono_s=self._began_mono_s,
            clear_count=self._clear_count,
        )


def told_probability(probability: NDArray[Any]) -> U8:
    """255 is 1; above 127 exactly where it is above one half."""
    scaled = np.rint(np.asarray(probability, np.float64) * 255.0)
    return np.where(probability > 0.5, np.maximum(scaled, 128), np.minimum(scaled, 127)).astype(np.uint8)


class MapSender:
    """``put`` by the event loop, ``run`` as a task in it. A whole map makes all that still waits needless."""

    def __init__(self, publish: Callable[[MapDelta], None]) -> None:
        self._publish = publish
        self._waiting: deque[MapDelta] = deque()
        self._ready, self._empty = asyncio.Event(), asyncio.Event()
        self._empty.set()

    def put(self, deltas: Sequence[MapDelta]) -> bool:
        """False: too many wait already, and these are left out, with all that waited."""
        if deltas and deltas[0].whole:
            self._waiting.clear()
        elif len(self._waiting) + len(deltas) > MOST_PARTS:
            self._waiting.clear()
            return False
        self._waiting.extend(deltas)
        self._ready.set()
        self._empty.clear()
        return True

    async def sent(self) -> None:
        """Waits until all that was put has been published."""
        await self._empty.wait()

    async def run(self) -> None:
        in_a_row = 0
        while True:
            while self._waiting:
                self._publish(self._waiting.popleft())
                in_a_row += 1
                if in_a_row >= AT_ONCE and self._waiting:
                    await asyncio.sleep(BETWEEN_S)
                    in_a_row = 0
            self._empty.set()
            self._ready.clear()
            await self._ready.wait()
            in_a_row = 0
