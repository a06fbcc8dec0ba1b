"""Sends maps in parts, no faster than readers can take them: what comes too fast for one of them is lost to it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence

from telemetry.topics.obstacles import MapDelta

AT_ONCE = 2
BETWEEN_S = 0.02
MOST_PARTS = 400
"""Eight million voxels. When so many wait, something is wrong, and the map is told whole instead."""


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
