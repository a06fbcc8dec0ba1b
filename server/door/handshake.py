"""TLS before HTTP: a connection counts from its first byte on, and has shaken hands in time.

asyncio's own server tells nobody of a connection before its handshake is over: strangers who never end one would hold
as many files as they like.
"""

from __future__ import annotations

import asyncio
import ssl
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from server.door.connections import HEADER_S, OpenConnections
from server.door.tries import place_of


def behind_tls(
    protocol: type[H11Protocol], context: ssl.SSLContext, connections: OpenConnections, *, handshake_s: float = HEADER_S
) -> type[asyncio.Protocol]:
    """``protocol`` over TLS; ``connections`` counts and cuts off who is still shaking hands as well."""

    class Handshake(asyncio.Protocol):
        def __init__(self, **given: Any) -> None:
            self._given = given
            self._early = bytearray()

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            transport.pause_reading()  # what comes before ``start_tls`` is for it
            peer = transport.get_extra_info("peername")
            connections.admit(transport, place_of(peer[0] if peer else ""))
            self._shaking = asyncio.get_running_loop().create_task(self._shake_hands(transport))

        def data_received(self, data: bytes) -> None:
            """A client may ask in the same breath in which it ends its handshake."""
            self._early += data

        async def _shake_hands(self, plain: asyncio.Transport) -> None:
            try:
                line = await asyncio.get_running_loop().start_tls(
                    plain, self, context, server_side=True, ssl_handshake_timeout=handshake_s
                )
            except OSError:  # of TLS and of the line alike
                plain.abort()
                return
            finally:
                connections.gone(plain)
            if line is None or line.is_closing():
                return
            inner = protocol(**self._given)
            line.set_protocol(inner)
            inner.connection_made(line)
            if self._early:
                inner.data_received(bytes(self._early))

    return Handshake
