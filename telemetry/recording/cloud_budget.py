"""How many point clouds and local maps are recorded: as many as a disk can take for hours."""

from __future__ import annotations

from telemetry.topics.obstacles import MapDelta

BYTES_PER_S = 500_000
"""On average; some 20 MB a minute on disk. Clouds thinned to 8,000 points five times a second fit in whole."""
_BURST_BYTES = 4_000_000
LOCAL_EVERY_S = 0.5


class CloudBudget:
    """A bucket that fills with time; a cloud is recorded when there is anything in it."""

    def __init__(self) -> None:
        self.left_out = 0
        self._left = float(_BURST_BYTES)
        self._seen_s: float | None = None

    def takes(self, size_bytes: int, now_s: float) -> bool:
        elapsed_s = 0.0 if self._seen_s is None else max(0.0, now_s - self._seen_s)
        self._seen_s = now_s
        self._left = min(self._left + elapsed_s * BYTES_PER_S, _BURST_BYTES)
        if self._left <= 0.0:
            self.left_out += 1
            return False
        self._left -= size_bytes
        return True


class LocalMapBudget:
    """Vision's map comes whole with every frame: two a second are enough to look at again."""

    def __init__(self) -> None:
        self._taken_s: float | None = None
        self._revision = -1

    def takes(self, delta: MapDelta, now_s: float) -> bool:
        """All parts of a map or none; an empty one always, since nothing may follow it."""
        if delta.sensor != "vision" or not delta.whole:
            return True
        if delta.part > 0:
            return delta.revision == self._revision
        if delta.keys and self._taken_s is not None and now_s - self._taken_s < LOCAL_EVERY_S:
            return False
        self._taken_s, self._revision = now_s, delta.revision
        return True
