"""A bus inside one process, for tests of what hangs on the bus."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any


class SmallSubscription:
    def __init__(self, bus: SmallBus, topic: str) -> None:
        self._bus, self.topic = bus, topic
        self.queue: asyncio.Queue[Any] = asyncio.Queue()

    def __aiter__(self) -> AsyncIterator[tuple[str, Any]]:
        return self

    async def __anext__(self) -> tuple[str, Any]:
        return self.topic, await self.queue.get()

    def close(self) -> None:
        self._bus.subscriptions.remove(self)


class SmallBus:
    """Exact topics only; a late subscriber gets the last message."""

    def __init__(self) -> None:
        self.subscriptions: list[SmallSubscription] = []
        self.last: dict[str, Any] = {}
        self.published: list[tuple[str, Any]] = []

    def publish(self, topic: str, message: Any) -> None:
        self.last[topic] = message
        self.published.append((topic, message))
        for subscription in self.subscriptions:
            if subscription.topic == topic:
                subscription.queue.put_nowait(message)

    def subscribe(self, pattern: str, *, keep_all: bool = False, limit: int = 1000) -> SmallSubscription:
        subscription = SmallSubscription(self, pattern)
        self.subscriptions.append(subscription)
        if pattern in self.last:
            subscription.queue.put_nowait(self.last[pattern])
        return subscription
