"""What has come and was not worked on yet: a callback puts, one thread takes, and who is slow loses the oldest."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping

from telemetry.ros2.wire import WireSample


class Inbox:
    """One row for each name. ``put`` never blocks; ``take`` empties rows by turns, so that none waits for ever."""

    def __init__(self, most: Mapping[str, int]) -> None:
        """``most``: how many wait under each name."""
        self._rows: dict[str, deque[WireSample]] = {name: deque(maxlen=count) for name, count in most.items()}
        self._ready, self._next = threading.Condition(), 0
        self.dropped = dict.fromkeys(most, 0)
        """By name: that were not taken in time."""

    def put(self, name: str, sample: WireSample) -> None:
        with self._ready:
            row = self._rows[name]
            self.dropped[name] += len(row) == row.maxlen
            row.append(sample)
            self._ready.notify()

    def take(self, timeout_s: float) -> tuple[str, WireSample] | None:
        """The oldest of the next row that is not empty; None when nothing came in that time."""
        with self._ready:
            self._ready.wait_for(lambda: any(self._rows.values()), timeout_s)
            names = list(self._rows)
            for place in range(self._next, self._next + len(names)):
                name = names[place % len(names)]
                if row := self._rows[name]:
                    self._next = place % len(names) + 1
                    return name, row.popleft()
        return None
