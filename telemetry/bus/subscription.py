"""What a subscriber has not read yet: filled by the bus's own threads, read in the subscriber's event loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Self

from telemetry.bus.encoding import decode_message
from telemetry.errors import BusError
from telemetry.topics.messages import Published

_log = logging.getLogger(__name__)

_BREATH = 64
"""Messages read in a row before the event loop gets its turn."""


class Subscription:
    """Async iterator of ``(topic, message)``; ends when it or the bus is closed.

    ``keep_all`` False: of each topic only the newest unread message waits. True: all wait in order, up to ``limit``;
    beyond it the oldest is dropped and counted in ``dropped``.
    """

    def __init__(self, pattern: str, *, keep_all: bool, limit: int, undeclare: Callable[[Subscription], None]) -> None:
        self.pattern = pattern
        self.dropped = 0
        self._keep_all = keep_all
        self._limit = limit
        self._undeclare = undeclare
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._newest: dict[str, bytes] = {}
        self._all: deque[tuple[str, bytes]] = deque()
        self._stamps: dict[str, int] = {}
        self._ready = asyncio.Event()
        self._woken = False
        self._closed = False
        self._read = 0
        self._misread: set[str] = set()

    def offer(self, topic: str, payload: bytes, stamp: int, *, kept: bool = False) -> None:
        """Called from any thread. ``kept``: a publisher's last message, asked for; it may have come already."""
        with self._lock:
            if kept and stamp <= self._stamps.get(topic, -1):
                return
            self._stamps[topic] = stamp
            self._store(topic, payload)
            wake, self._woken = not self._woken, True
        if wake:  # once per wake-up, not per message
            self._wake()

    def close(self) -> None:
        """Ends the iteration; what was not read is lost. May be called twice."""
        if self._closed:
            return
        self._closed = True
        self._ready.set()
        self._undeclare(self)

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> tuple[str, Published]:
        while True:
            topic, payload = await self._next()
            try:
                return topic, decode_message(topic, payload)
            except BusError as error:
                self._report(topic, error)

    async def _next(self) -> tuple[str, bytes]:
        self._read += 1
        if self._read % _BREATH == 0:
            await asyncio.sleep(0)
        while not self._closed:
            with self._lock:
                if item := self._take():
                    return item
                self._woken = False
                self._ready.clear()
            await self._ready.wait()
        raise StopAsyncIteration

    def _store(self, topic: str, payload: bytes) -> None:
        if not self._keep_all:
            self._newest[topic] = payload
            return
        if len(self._all) >= self._limit:
            self._all.popleft()
            self.dropped += 1
        self._all.append((topic, payload))

    def _take(self) -> tuple[str, bytes] | None:
        if self._keep_all:
            return self._all.popleft() if self._all else None
        topic = next(iter(self._newest), None)
        return None if topic is None else (topic, self._newest.pop(topic))

    def _wake(self) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended, and the subscriber with it
            self._loop.call_soon_threadsafe(self._ready.set)

    def _report(self, topic: str, error: BusError) -> None:
        if topic not in self._misread:  # once per topic: a foreign publisher goes on and on
            self._misread.add(topic)
            _log.warning("Message left out: %s", error)
