"""From the bus to those who keep and publish it: each kind of message by a loop of its own, so that none waits."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from telemetry.bus.bus import Bus
from telemetry.topics.messages import REPLAY_PREFIX, Topic

Handler = Callable[[Any], object]


class Relay:
    """``on`` names who hears what; ``loops`` then run until they are cancelled."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._routes: list[tuple[str, Handler, bool]] = []

    def on(self, topic: Topic, handler: Handler, *, replayed: bool = False, each: bool = False) -> None:
        """``each``: every message arrives, not only the latest; ``replayed``: the topic's replay instead."""
        name = f"{REPLAY_PREFIX}{topic}" if replayed else str(topic)
        self._routes.append((name, handler, each))

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        return [self._listen(*route) for route in self._routes]

    async def _listen(self, name: str, handler: Handler, each: bool) -> None:
        subscription = self._bus.subscribe(name, keep_all=each)
        try:
            async for _, message in subscription:
                done = handler(message)
                if isinstance(done, Awaitable):
                    await done
        finally:
            subscription.close()
