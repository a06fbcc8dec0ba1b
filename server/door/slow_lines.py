"""WebSockets over lines that take less than there is to say: what is new must not wait behind what is old."""

from __future__ import annotations

import asyncio
import logging
import socket

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

log = logging.getLogger("hedgehop.http")

UNSENT_BYTES = 8_192
"""Of a connection: more waits in the hub, where a newer message takes its place."""
STALLED_S = 5.0
STALLED_AFTER_MS = 30_000


def keep_little_back(listening: socket.socket) -> None:
    """For all connections of this socket, which inherit it: of what the line has not taken the kernel holds little, and
    a browser that takes no bytes any more does not hold its buffers for ever."""
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, STALLED_AFTER_MS)
    if hasattr(socket, "TCP_NOTSENT_LOWAT"):
        listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)


class PromptWebSocket(WebSocketsSansIOProtocol):
    """Holds little back itself; a line that takes nothing for five seconds is cut, however much a slow one has left."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(high=UNSENT_BYTES)

    def pause_writing(self) -> None:
        super().pause_writing()
        self._look_again(self.transport.get_write_buffer_size())

    def _look_again(self, left_bytes: int) -> None:
        asyncio.get_running_loop().call_later(STALLED_S, self._look, left_bytes)

    def _look(self, before_bytes: int) -> None:
        if self.writable.is_set() or self.transport.is_closing():
            return
        left_bytes = self.transport.get_write_buffer_size()
        if left_bytes < before_bytes:
            self._look_again(left_bytes)
            return
        log.warning("A page took nothing for %g s and was dropped.", STALLED_S)
        self.transport.abort()
