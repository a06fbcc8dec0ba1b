"""The pages' stream over lines that take less than there is to say: what is new must not wait behind what is old."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Sequence

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.extensions import Extension
from websockets.extensions.permessage_deflate import PerMessageDeflate, ServerPerMessageDeflateFactory
from websockets.frames import Frame
from websockets.http11 import Request
from websockets.typing import ExtensionParameter

log = logging.getLogger("hedgehop.http")

STREAM_PATH = "/ws"
UNSENT_BYTES = 2_048
"""That the line has not taken: more waits in the hub, where a newer message takes its place."""
DEFLATED_MAX_BYTES = 262_144
"""Larger messages go as they are: the loop does not wait for them."""
STALLED_S = 5.0


class _Deflating(PerMessageDeflate):
    """Makes messages smaller that are not too large for it. They resemble each other: a tenth to a sixth is left."""

    def encode(self, frame: Frame) -> Frame:
        return frame if len(frame.data) > DEFLATED_MAX_BYTES else super().encode(frame)


class _DeflatingFactory(ServerPerMessageDeflateFactory):
    def process_request_params(
        self, params: Sequence[ExtensionParameter], accepted_extensions: Sequence[Extension]
    ) -> tuple[list[ExtensionParameter], PerMessageDeflate]:
        answer, agreed = super().process_request_params(params, accepted_extensions)
        return answer, _Deflating(
            agreed.remote_no_context_takeover,
            agreed.local_no_context_takeover,
            agreed.remote_max_window_bits,
            agreed.local_max_window_bits,
            agreed.compress_settings,
        )


class PageWebSocket(WebSocketsSansIOProtocol):
    """The stream goes deflated, hardly anything of it waits here or in the kernel; a line that takes nothing is cut.

    The 3D view's sockets keep their buffers: a mesh of 36 MB is one message, and a browser that draws takes its time.
    """

    _is_stream = False
    _watch: asyncio.TimerHandle | None = None

    def handle_connect(self, event: Request) -> None:
        if event.path.partition("?")[0] == STREAM_PATH:
            self._is_stream = True
            self._keep_little_back()
            # Pages tell little: their side may keep little.
            self.conn.available_extensions = [
                _DeflatingFactory(client_max_window_bits=12, compress_settings={"level": 1})
            ]
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
