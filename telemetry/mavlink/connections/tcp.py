"""TCP: connecting to a vehicle's port, or waiting for vehicles to connect."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
from typing import Any

from telemetry.mavlink.connections.base import SEND_LIMIT_BYTES, Connection, Peer

CONNECT_S = 5.0
READ_BYTES = 65536
MOST_CLIENTS = 8


class _Tcp(Connection):
    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._writers: dict[Peer, asyncio.StreamWriter] = {}

    async def _read(self, peer: Peer, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Until the far end hangs up."""
        self._writers[peer] = writer
        try:
            _notice_dead_peers(writer)
            while data := await reader.read(READ_BYTES):
                self.receiver.received(peer, data)
        finally:
            del self._writers[peer]
            writer.transport.abort()  # close() would wait until a far end that has stopped reading has read all
            self.receiver.gone(peer)
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    def _send_to(self, data: bytes, writer: asyncio.StreamWriter | None) -> bool:
        if writer is None or writer.is_closing() or writer.transport.get_write_buffer_size() > SEND_LIMIT_BYTES:
            return False
        writer.write(data)
        return True


class TcpClient(_Tcp):
    async def _stay_open(self) -> None:
        try:
            async with asyncio.timeout(CONNECT_S):
                reader, writer = await asyncio.open_connection(self.address.host, self.address.port)
        except TimeoutError as error:
            raise OSError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT)) from error
        self._opened()
        await self._read(f"{self.address.host}:{self.address.port}", reader, writer)

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        return self._send_to(data, next(iter(self._writers.values()), None))


class TcpServer(_Tcp):
    async def _stay_open(self) -> None:
        server = await asyncio.start_server(self._serve, self.address.host, self.address.port)
        try:
            self._opened()
            await server.serve_forever()
        finally:
            server.close()
            for writer in self._writers.values():
                writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        host, port = writer.get_extra_info("peername")[:2]
        if len(self._writers) >= MOST_CLIENTS:
            writer.close()
            return
        with contextlib.suppress(OSError, asyncio.CancelledError):
            await self._read(f"{host}:{port}", reader, writer)

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        return self._send_to(data, self._writers.get(peer or ""))


def _notice_dead_peers(writer: asyncio.StreamWriter) -> None:
    """A far end whose power was cut sends no FIN: the system asks after 5 s, three times a second apart."""
    sock = writer.get_extra_info("socket")
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (("TCP_KEEPIDLE", 5), ("TCP_KEEPINTVL", 1), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, name):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
