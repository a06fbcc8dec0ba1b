"""What a flight's conductor sees: the newest of what the vehicle and the link publish, and waiting for it to change."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Protocol, TypeVar

from telemetry.topics.messages import FlightStatus, LinkStatus, Topic, VehicleText
from telemetry.topics.vehicle import VehicleState

T = TypeVar("T")


class Subscribes(Protocol):
    """The part of the bus that is needed here."""

    def subscribe(self, pattern: str, *, keep_all: bool = False, limit: int = 1000) -> Any: ...

    def publish(self, topic: str, message: Any) -> None: ...


class Asks(Protocol):
    """The link node's client: raises what the link node raised."""

    async def call(self, request: Any) -> Any: ...


class Watch:
    """Latest values; ``run`` keeps them up to date until it is cancelled."""

    def __init__(self, bus: Subscribes, *, on_text: Callable[[VehicleText], None] | None = None) -> None:
        self.vehicle: VehicleState | None = None
        self.link: LinkStatus | None = None
        self.flight = FlightStatus()
        self._bus = bus
        self._on_text = on_text
        self._changed = asyncio.Condition()

    async def run(self) -> None:
        async with asyncio.TaskGroup() as tasks:
            for topic in (Topic.VEHICLE, Topic.LINK, Topic.FLIGHT):
                tasks.create_task(self._follow(topic, keep_all=False))
            tasks.create_task(self._follow(Topic.TEXT, keep_all=True))

    async def until(self, wanted: Callable[[Watch], T | None], *, timeout_s: float) -> T | None:
        """The first answer that is not None; None once the time is up."""
        try:
            async with asyncio.timeout(timeout_s), self._changed:
                while (answer := wanted(self)) is None:
                    await self._changed.wait()
                return answer
        except TimeoutError:
            return None

    async def _follow(self, topic: str, *, keep_all: bool) -> None:
        subscription = self._bus.subscribe(topic, keep_all=keep_all)
        try:
            async for _, message in subscription:
                await self._take(message)
        finally:
            subscription.close()

    async def _take(self, message: object) -> None:
        if isinstance(message, VehicleText):
            if self._on_text is not None:
                self._on_text(message)
            return
        if isinstance(message, VehicleState):
            self.vehicle = message
        elif isinstance(message, LinkStatus):
            self.link = message
        elif isinstance(message, FlightStatus):
            self.flight = message
        async with self._changed:
            self._changed.notify_all()


@asynccontextmanager
async def watching(bus: Subscribes, *, on_text: Callable[[VehicleText], None] | None = None) -> AsyncIterator[Watch]:
    """A watch that runs until the end of the block, whose errors come out as they are."""
    watch = Watch(bus, on_text=on_text)
    try:
        async with asyncio.TaskGroup() as tasks:
            runner = tasks.create_task(watch.run())
            try:
                yield watch
            finally:
                runner.cancel()
    except BaseExceptionGroup as group:
        raise _single(group) from None


def _single(group: BaseExceptionGroup) -> BaseException:
    error: BaseException = group
    while isinstance(error, BaseExceptionGroup) and len(error.exceptions) == 1:
        error = error.exceptions[0]
    return error
