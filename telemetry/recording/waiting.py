"""What waits to be written: no more of the large messages than a disk takes, and the others never wait for them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from mapping.sensor_frames import CloudFrame
from telemetry.recording.recorded_topics import BULKY
from telemetry.recording.trigger import Stamped
from telemetry.topics.messages import Published, Topic
from telemetry.topics.obstacles import MapDelta

BYTES_PER_S = 500_000
"""On average; some 20 MB a minute on disk. Clouds thinned to 8,000 points five times a second fit in whole."""
_BURST_BYTES = 4_000_000
LOCAL_EVERY_S = 0.5
M = TypeVar("M")

_MOST = 100_000
_MOST_BYTES = {Topic.CLOUD_FRAME: 16_000_000}
_MOST_MAP_BYTES = 96_000_000
"""A map whose changes were dropped is wrong until it is told whole: clouds give way first."""
_BULK_PER_TURN_BYTES = 2_000_000
"""Some 60 ms of writing."""


class CloudBudget:
    """A bucket that fills with time; a cloud is recorded when there is anything in it."""

    def __init__(self) -> None:
        self._left = float(_BURST_BYTES)
        self._seen_s: float | None = None

    def takes(self, size_bytes: int, now_s: float) -> bool:
        elapsed_s = 0.0 if self._seen_s is None else max(0.0, now_s - self._seen_s)
        self._seen_s = now_s
        self._left = min(self._left + elapsed_s * BYTES_PER_S, _BURST_BYTES)
        if self._left <= 0.0:
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


def bulk_bytes(message: Published) -> int:
    """How large a message is that may be large; 0 for all others."""
    if isinstance(message, CloudFrame):
        return len(message.xyz_m)
    if isinstance(message, MapDelta):
        return len(message.keys) + len(message.probability) + len(message.explained)
    return 0


class Waiting(Generic[M]):
    """Filled by one thread, emptied by another. Marks keep their place between the messages before and after them."""

    def __init__(self) -> None:
        self.dropped = 0
        """Messages that a slow disk had no time for."""
        self._small: deque[Stamped | M] = deque()
        self._bulky: deque[Stamped | M] = deque()
        self._bytes_in = self._bytes_out = 0

    def mark(self, mark: M) -> None:
        self._bulky.append(mark)
        self._small.append(mark)

    def put(self, stamped: Stamped) -> None:
        """The newest are dropped when the disk does not follow: what was taken before is written in order."""
        if stamped.topic not in BULKY:
            self._put(self._small, stamped, room=len(self._small) < _MOST)
            return
        size, waiting = bulk_bytes(stamped.message), self._bytes_in - self._bytes_out
        most = _MOST_BYTES.get(Topic(stamped.topic), _MOST_MAP_BYTES)
        if self._put(self._bulky, stamped, room=waiting + size <= most and len(self._bulky) < _MOST):
            self._bytes_in += size

    def take(self) -> Iterator[Stamped | M]:
        """All small ones that wait by now, then as many of the large ones as fit into one turn."""
        for _ in range(len(self._small)):
            item = self._small.popleft()
            if not isinstance(item, Stamped):
                yield from self._bulky_until(item)
            yield item
        until = self._bytes_out + _BULK_PER_TURN_BYTES
        while self._bulky and self._bytes_out < until and isinstance(self._bulky[0], Stamped):
            yield self._next_bulky()

    def _put(self, queue: deque[Stamped | M], stamped: Stamped, *, room: bool) -> bool:
        if room:
            queue.append(stamped)
        else:
            self.dropped += 1
        return room

    def _bulky_until(self, mark: M) -> Iterator[Stamped | M]:
        while self._bulky[0] is not mark:
            yield self._next_bulky()
        self._bulky.popleft()

    def _next_bulky(self) -> Stamped | M:
        item = self._bulky.popleft()
        if isinstance(item, Stamped):
            self._bytes_out += bulk_bytes(item.message)
        return item
