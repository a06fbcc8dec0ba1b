"""The pages' stream over lines that take less than there is to say: what is new must not wait behind what is old."""

from __future__ import annotations

import asyncio
import logging
import socket

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

log = logging.getLogger("hedgehop.http")

STREAM_PATH = "/ws"
UNSENT_BYTES = 8_192
"""That the line has not taken: more waits in the hub, where a newer message takes its place."""
STALLED_S = 5.0


class PageWebSocket(WebSocketsSansIOProtocol):
    """Of the stream, hardly anything waits here or in the kernel, and a line that takes nothing is cut.

    The 3D view's sockets keep their buffers: a mesh of 36 MB is one message, and a browser that draws takes its time.
    """

    _is_stream = False
    _watch: asyncio.TimerHandle | None = None

    def handle_connect(self, event: Request) -> None:
        if event.path.partition("?")[0] == STREAM_PATH:
            self._is_stream = True
            self._keep_little_back()
        super().handle_connect(event)

    def _keep_little_back(self) -> None:
        self.transport.set_write_buffer_limits(high=UNSENT_BYTES)
        line = self.transport.get_extra_info("socket")
        if hasattr(socket, "TCP_NOTSENT_LOWAT") and line is not None:
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)

    def pause_writing(self) -> None:
        super().pause_writing()
        if self._is_stream:
            self._look_again()

    def resume_writing(self) -> None:
        self._look_no_more()
        super().resume_writing()

    def _look_again(self) -> None:
        self._watch = self.loop.call_later(STALLED_S, self._look, self.transport.get_write_buffer_size())

    def _look(self, before_bytes: int) -> None:
        """However large one message is and however slow the line, it takes something in that time, or it stands."""
        if self.transport.get_write_buffer_size() < before_bytes:
            self._look_again()
            return
        log.warning("A page took nothing for %g s and was dropped.", STALLED_S)
        self.transport.abort()

    def _look_no_more(self) -> None:
        if self._watch is not None:
            self._watch.cancel()

    def send_keepalive_ping(self) -> None:
        if self.writable.is_set():
            super().send_keepalive_ping()
        else:  # behind a large message its answer would be late: meanwhile ``_look`` watches the line
            self.schedule_ping()

    def connection_lost(self, exc: Exception | None) -> None:
        self._look_no_more()
        super().connection_lost(exc)
