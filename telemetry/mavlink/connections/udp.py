"""UDP: listening for whoever comes, or talking to one named host."""

from __future__ import annotations

import asyncio
import socket
from abc import abstractmethod
from collections import OrderedDict
from typing import Any

from telemetry.mavlink.connections.base import SEND_LIMIT_BYTES, Connection, Peer

MOST_PEERS = 64
"""Senders remembered; the one that was silent longest is forgotten first."""
RECEIVE_BUFFER_BYTES = 1 << 20


class _Protocol(asyncio.DatagramProtocol):
    def __init__(self, connection: _Udp) -> None:
        self._connection = connection
        self.closed = asyncio.get_running_loop().create_future()

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._connection.heard(data, addr)

    def error_received(self, exc: Exception) -> None:
        """An ICMP answer to a datagram of ours: nobody listens there yet, which the missing heartbeat says better."""

    def connection_lost(self, exc: Exception | None) -> None:
        if not self.closed.done():
            self.closed.set_result(exc)


class _Udp(Connection):
    datagrams = True
    _transport: Any = None
    """A DatagramTransport; its type does not know the size of its buffer."""

    @abstractmethod
    def heard(self, data: bytes, addr: Any) -> None:
        """A datagram, and who sent it."""

    @abstractmethod
    async def _endpoint(self) -> tuple[asyncio.DatagramTransport, _Protocol]:
        """The open socket. Raises OSError."""

    async def _stay_open(self) -> None:
        transport, protocol = await self._endpoint()
        try:
            sock = transport.get_extra_info("socket")
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
            self._transport = transport
            self._opened()
            error = await protocol.closed
            if error is not None:
                raise error
        finally:
            self._transport = None
            transport.close()

    def _send_to(self, data: bytes, addr: Any) -> bool:
        transport = self._transport
        if transport is None or transport.get_write_buffer_size() > SEND_LIMIT_BYTES:
            return False
        transport.sendto(data, addr)
        return True


class UdpIn(_Udp):
    """Listens. Sends only to a peer that is named, which is the adopted vehicle's."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._peers: OrderedDict[Peer, Any] = OrderedDict()

    async def _endpoint(self) -> tuple[asyncio.DatagramTransport, _Protocol]:
        loop = asyncio.get_running_loop()
        local = (self.address.host, self.address.port)
        return await loop.create_datagram_endpoint(lambda: _Protocol(self), local_addr=local)

    def heard(self, data: bytes, addr: Any) -> None:
        peer = f"{addr[0]}:{addr[1]}" if ":" not in addr[0] else f"[{addr[0]}]:{addr[1]}"
        self._peers[peer] = addr
        self._peers.move_to_end(peer)
        if len(self._peers) > MOST_PEERS:
            self.receiver.gone(self._peers.popitem(last=False)[0])
        self.receiver.received(peer, data)

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        """Also to one that has not been heard here: the node before this one knew where its vehicle is."""
        return peer is not None and self._send_to(data, self._peers.get(peer) or _addr(peer))


class UdpOut(_Udp):
    """Talks to one host; the operating system drops what others send to this socket."""

    async def _endpoint(self) -> tuple[asyncio.DatagramTransport, _Protocol]:
        loop = asyncio.get_running_loop()
        remote = (self.address.host, self.address.port)
        return await loop.create_datagram_endpoint(lambda: _Protocol(self), remote_addr=remote)

    def heard(self, data: bytes, addr: Any) -> None:
        self.receiver.received(f"{self.address.host}:{self.address.port}", data)

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        return self._send_to(data, None)


def _addr(peer: Peer) -> tuple[str, int]:
    host, _, port = peer.rpartition(":")
    return host.strip("[]"), int(port)
