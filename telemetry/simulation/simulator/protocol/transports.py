"""How ground stations reach the simulated vehicle: UDP out, UDP in, and TCP in for several at once."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal, Protocol, cast

from telemetry.errors import AddressError, ConnectionFailedError

Scheme = Literal["udpout", "udpin", "tcpin"]
MOST_PEERS = 16
"""Over UDP the one that has been silent longest is forgotten for a new one; over TCP the new one is turned away."""
MOST_WAITING_BYTES = 1 << 20
"""A TCP client that reads too slowly for this much is cut off."""


@dataclass(frozen=True, slots=True)
class Where:
    scheme: Scheme
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.scheme}:{self.host}:{self.port}"

    @property
    def hint(self) -> str:
        """How a ground station gets there."""
        if self.scheme == "udpout":
            return f"listen with udpin:{self.host}:{self.port}"
        host = "127.0.0.1" if self.host in ("0.0.0.0", "::") else self.host
        return f"connect with {'tcp' if self.scheme == 'tcpin' else 'udpout'}:{host}:{self.port}"


def parse_where(text: str) -> Where:
    """``udpout:HOST:PORT``, ``udpin:HOST:PORT`` or ``tcpin:HOST:PORT``; ``//`` may follow the first colon."""
    match = re.fullmatch(r"(udpout|udpin|tcpin):(?://)?(\[[0-9a-fA-F:]+\]|[\w.-]*):(\d{1,5})", text.strip())
    if not match or not 0 <= int(match[3]) <= 65535:
        raise AddressError(
            f'"{text}" is no address that the simulated vehicle offers.',
            advice="Write udpout:127.0.0.1:14550, udpin:127.0.0.1:14551 or tcpin:127.0.0.1:5760.",
        )
    scheme: Scheme = "udpout" if match[1] == "udpout" else "udpin" if match[1] == "udpin" else "tcpin"
    return Where(scheme, match[2].strip("[]") or ("127.0.0.1" if scheme == "udpout" else "0.0.0.0"), int(match[3]))


class Listener(Protocol):
    """What hears of ground stations. ``peer`` names one of them on its transport."""

    def joined(self, peer: Hashable) -> None: ...
    def received(self, peer: Hashable, data: bytes) -> None: ...
    def left(self, peer: Hashable) -> None: ...


class Transport(Protocol):
    where: Where
    """With the port that was really taken."""

    def send(self, peer: Hashable, data: bytes) -> None: ...
    def close(self) -> None: ...


async def open_transport(where: Where, listener: Listener) -> Transport:
    try:
        if where.scheme == "tcpin":
            return await _TcpServer.open(where, listener)
        return await _Udp.open(where, listener)
    except OSError as error:
        raise ConnectionFailedError(
            f"{where} cannot be opened: {error.strerror or error}.",
            where="simulated vehicle",
            advice="Is another program using the port? Choose another one.",
        ) from error


class _Udp(asyncio.DatagramProtocol):
    """One datagram per message. With udpout the one peer is known from the start."""

    def __init__(self, where: Where, listener: Listener) -> None:
        self.where = where
        self._listener = listener
        self._peers: dict[Hashable, None] = {}
        """Longest silent first."""
        self._socket: asyncio.DatagramTransport | None = None

    @classmethod
    async def open(cls, where: Where, listener: Listener) -> _Udp:
        loop = asyncio.get_running_loop()
        place = (where.host, where.port)
        if where.scheme == "udpout":
            _, self = await loop.create_datagram_endpoint(lambda: cls(where, listener), remote_addr=place)
            self._meet(None)
        else:
            _, self = await loop.create_datagram_endpoint(lambda: cls(where, listener), local_addr=place)
        return self

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._socket = cast(asyncio.DatagramTransport, transport)
        if self.where.scheme == "udpin":
            self.where = Where("udpin", self.where.host, transport.get_extra_info("sockname")[1])

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        peer = None if self.where.scheme == "udpout" else addr
        self._meet(peer)
        self._listener.received(peer, data)

    def _meet(self, peer: Hashable) -> None:
        if self._peers.pop(peer, False) is False:
            self._listener.joined(peer)
        self._peers[peer] = None
        if len(self._peers) > MOST_PEERS:
            silent = next(iter(self._peers))
            del self._peers[silent]
            self._listener.left(silent)

    def error_received(self, exc: Exception) -> None:
        """Nobody listens yet at the other end: go on sending."""

    def send(self, peer: Hashable, data: bytes) -> None:
        if self._socket and not self._socket.is_closing():
            self._socket.sendto(data, peer if isinstance(peer, tuple) else None)

    def close(self) -> None:
        if self._socket:
            self._socket.close()


class _TcpServer:
    def __init__(self, where: Where, listener: Listener) -> None:
        self.where = where
        self._listener = listener
        self._clients: dict[Hashable, _TcpClient] = {}
        self._server: asyncio.Server | None = None

    @classmethod
    async def open(cls, where: Where, listener: Listener) -> _TcpServer:
        self = cls(where, listener)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: _TcpClient(self), where.host, where.port)
        self.where = Where("tcpin", where.host, self._server.sockets[0].getsockname()[1])
        return self

    def joined(self, client: _TcpClient) -> bool:
        if len(self._clients) >= MOST_PEERS:
            return False
        self._clients[client.peer] = client
        self._listener.joined(client.peer)
        return True

    def left(self, client: _TcpClient) -> None:
        if self._clients.pop(client.peer, None):
            self._listener.left(client.peer)

    def received(self, client: _TcpClient, data: bytes) -> None:
        self._listener.received(client.peer, data)

    def send(self, peer: Hashable, data: bytes) -> None:
        if client := self._clients.get(peer):
            client.send(data)

    def close(self) -> None:
        if self._server:
            self._server.close()
        for client in list(self._clients.values()):
            client.abort()


class _TcpClient(asyncio.Protocol):
    def __init__(self, server: _TcpServer) -> None:
        self._server = server
        self._transport: asyncio.Transport | None = None
        self.peer: Hashable = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        self.peer = transport.get_extra_info("peername")
        if not self._server.joined(self):
            self._transport.abort()

    def data_received(self, data: bytes) -> None:
        self._server.received(self, data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.left(self)

    def send(self, data: bytes) -> None:
        assert self._transport is not None
        if self._transport.get_write_buffer_size() > MOST_WAITING_BYTES:
            self._transport.abort()
        elif not self._transport.is_closing():
            self._transport.write(data)

    def abort(self) -> None:
        if self._transport:
            self._transport.abort()
