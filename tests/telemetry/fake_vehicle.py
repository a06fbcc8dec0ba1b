"""A vehicle's radio with nothing behind it: sends what a test says, keeps what it hears, on real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.codec import Parser
from tests.telemetry.frames import heartbeat, packed


class UdpVehicle:
    """Sends from a port of its own to a listening ground station."""

    def __init__(self, port: int, *, system: int = 1, component: int = 1) -> None:
        self.system, self.component = system, component
        self.heard: list[Any] = []
        self._parser = Parser(datagrams=True)
        self._sequence = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.setblocking(False)
        asyncio.get_running_loop().add_reader(self._socket, self._read)

    @property
    def port(self) -> int:
        return self._socket.getsockname()[1]

    def send(self, *messages: Any) -> None:
        for message in messages:
            frame = packed(message, system=self.system, component=self.component, sequence=self._sequence)
            self._sequence = (self._sequence + 1) % 256
            self.send_bytes(frame)

    def send_bytes(self, data: bytes) -> None:
        try:
            self._socket.send(data)
        except ConnectionRefusedError:
            self._socket.send(data)  # the refusal was about an earlier datagram

    def kinds(self) -> set[str]:
        return {message.get_type() for message in self.heard}

    def of(self, kind: str) -> list[Any]:
        return [message for message in self.heard if message.get_type() == kind]

    def close(self) -> None:
        asyncio.get_running_loop().remove_reader(self._socket)
        self._socket.close()

    def _read(self) -> None:
        try:
            self.heard += self._parser.feed(self._socket.recv(4096))
        except OSError:
            return


async def beat(vehicle: UdpVehicle, *, hz: float = 10.0, message: Any = None) -> None:
    """Heartbeats until it is cancelled."""
    while True:
        vehicle.send(message or heartbeat())
        await asyncio.sleep(1 / hz)


@contextlib.asynccontextmanager
async def radio(port: int, *, message: Any = None, **ids: int) -> AsyncIterator[UdpVehicle]:
    """A vehicle that beats ten times a second."""
    vehicle = UdpVehicle(port, **ids)
    task = asyncio.create_task(beat(vehicle, message=message))
    try:
        yield vehicle
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        vehicle.close()


def ack(command: int, result: int) -> Any:
    return mavlink.MAVLink_command_ack_message(command, result, 0, 0, 255, 190)
