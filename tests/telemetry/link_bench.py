"""A link with real sockets for tests: what it publishes is kept, and conditions are waited for."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from typing import Any

from telemetry.link.adopted import AdoptedVehicle
from telemetry.link.answering import Answering, OperatorRight
from telemetry.link.link import Link, open_link
from telemetry.link.piloting.pilot import Pilot
from telemetry.topics.messages import (
    CommandRecord,
    FlightStatus,
    LinkStatus,
    Published,
    RawFrame,
    Topic,
    TransferStatus,
    VehicleText,
)
from telemetry.topics.requests import Connect, LinkRequest, Operator
from telemetry.topics.vehicle import VehicleState
from tests.free_ports import free_port

PATIENCE_S = 60.0
ME = Operator("Ann", 1)


async def until(condition: Callable[[], object], seconds: float = PATIENCE_S) -> None:
    async with asyncio.timeout(seconds):
        while not condition():
            await asyncio.sleep(0.01)


@contextlib.asynccontextmanager
async def again_and_again(look: Callable[[], None], every_s: float) -> AsyncIterator[None]:
    """Frames come in real time, while the body runs."""

    async def looking() -> None:
        while True:
            look()
            await asyncio.sleep(every_s)

    eye = asyncio.create_task(looking())
    try:
        yield
    finally:
        eye.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await eye


class Console:
    """Keeps everything that the link published."""

    def __init__(self) -> None:
        self.published: list[tuple[str, Published]] = []
        self.link: Link
        self._right = OperatorRight()

    async def handle(self, request: LinkRequest) -> Any:
        return await Answering(self.link, self._right).answer(request)

    @property
    def vehicle(self) -> AdoptedVehicle | None:
        return self.link.session and self.link.session.vehicle

    @property
    def pilot(self) -> Pilot | None:
        return self.link.session and self.link.session.pilot

    def publish(self, topic: str, message: Published) -> None:
        self.published.append((topic, message))

    def of(self, kind: type[Any]) -> list[Any]:
        return [message for _, message in self.published if isinstance(message, kind)]

    def last(self, kind: type[Any]) -> Any:
        return next((message for _, message in reversed(self.published) if isinstance(message, kind)), None)

    @property
    def status(self) -> LinkStatus:
        return self.link.status()

    @property
    def state(self) -> VehicleState:
        return self.last(VehicleState) or VehicleState(0, 0)

    @property
    def flight(self) -> FlightStatus:
        return self.link.flight.status

    @property
    def texts(self) -> list[str]:
        return [text.text for text in self.of(VehicleText)]

    @property
    def commands(self) -> list[str]:
        return [record.words for record in self.of(CommandRecord)]

    @property
    def transfers(self) -> list[TransferStatus]:
        return self.of(TransferStatus)

    def frames(self, *, sent: bool) -> list[bytes]:
        return [raw.frame for topic, raw in self.published if isinstance(raw, RawFrame) and raw.sent is sent]

    async def live(self) -> None:
        await until(lambda: self.status.state == "live")


@contextlib.asynccontextmanager
async def console(**options: Any) -> AsyncIterator[Console]:
    bench = Console()
    async with open_link(bench.publish, **options) as link:
        bench.link = link
        yield bench


@contextlib.asynccontextmanager
async def listening(*, adopt: bool, **options: Any) -> AsyncIterator[tuple[Console, int]]:
    port = free_port()
    async with console(**options) as bench:
        await bench.handle(Connect(ME, f"udpin:127.0.0.1:{port}", adopt))
        yield bench, port


__all__ = ["ME", "PATIENCE_S", "Console", "Topic", "console", "until"]
