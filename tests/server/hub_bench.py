"""A hub with fake browsers on it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any, cast

from starlette.websockets import WebSocket, WebSocketState

from server.door.hub import Hub
from tests.server.fakes import snapshot


class FakeSocket:
    """A browser's end; while ``stalled`` it takes nothing."""

    def __init__(self) -> None:
        self.application_state = self.client_state = WebSocketState.CONNECTED
        self.sent: list[dict[str, Any]] = []
        self.flowing = asyncio.Event()
        self.flowing.set()
        self.incoming: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.close_code: int | None = None

    async def send_text(self, text: str) -> None:
        await self.flowing.wait()
        self.sent.append(json.loads(text))

    async def receive(self) -> dict[str, Any]:
        return await self.incoming.get()

    async def close(self, code: int) -> None:
        self.close_code = code
        await self.flowing.wait()

    def says(self, text: str) -> None:
        self.incoming.put_nowait({"type": "websocket.receive", "text": text})

    def leaves(self) -> None:
        self.incoming.put_nowait({"type": "websocket.disconnect", "code": 1001})

    def types(self) -> list[str]:
        return [message["type"] for message in self.sent]


class Bench:
    """A hub with fake browsers on it."""

    def __init__(self) -> None:
        self.hub = Hub()
        self.heard: list[tuple[str, object]] = []
        self._tasks: list[asyncio.Task[None]] = []

    async def join(self, *, session: str = "s", remaining_s: float = 1000.0, page_id: str | None = None) -> FakeSocket:
        socket = FakeSocket()

        async def on_message(page_id: str, message: object) -> None:
            self.heard.append((page_id, message))

        self._tasks.append(
            asyncio.create_task(
                self.hub.serve(
                    cast(WebSocket, socket),
                    session_key=session,
                    session_remaining_s=remaining_s,
                    page_id=page_id,
                    snapshot=snapshot,
                    on_message=on_message,
                )
            )
        )
        await settled()
        return socket

    async def end(self) -> None:
        self.hub.close()
        await asyncio.gather(*self._tasks)


async def settled() -> None:
    for _ in range(50):
        await asyncio.sleep(0)


def run(scenario: Callable[[Bench], Awaitable[None]]) -> None:
    async def whole() -> None:
        bench = Bench()
        try:
            async with asyncio.timeout(60):
                await scenario(bench)
        finally:
            await bench.end()

    asyncio.run(whole())
