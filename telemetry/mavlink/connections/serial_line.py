"""A serial line: a USB flight controller or a telemetry radio, which may be unplugged at any moment."""

from __future__ import annotations

import asyncio
import errno
import os
from pathlib import Path
from typing import Any

import serial

from telemetry.errors import AddressError
from telemetry.mavlink.address import refuse_file
from telemetry.mavlink.connections.base import Connection, Peer

READ_BYTES = 4096
WAITING_LIMIT_BYTES = 8192
"""About 1.5 s at 57600 baud."""


class SerialLine(Connection):
    """Only opening it blocks, so only that runs in a thread; reading and writing follow the event loop."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._port: serial.Serial | None = None
        self._waiting = bytearray()

    async def _stay_open(self) -> None:
        port = await asyncio.to_thread(self._open_port)
        loop = asyncio.get_running_loop()
        over: asyncio.Future[None] = loop.create_future()
        descriptor = port.fileno()
        try:
            os.set_blocking(descriptor, False)
            self._port = port
            loop.add_reader(descriptor, self._readable, descriptor, over)
            self._opened()
            await over
        finally:
            self._port = None
            self._waiting.clear()
            loop.remove_reader(descriptor)
            loop.remove_writer(descriptor)
            port.close()
            self.receiver.gone(self.address.device)

    def _open_port(self) -> serial.Serial:
        """Raises OSError with the cause's number: pyserial hides it."""
        try:
            refuse_file(Path(self.address.device), self.address.text)
            return serial.Serial(self.address.device, self.address.baud, timeout=0, exclusive=True)
        except AddressError as error:
            raise OSError(errno.ENODEV, error.what) from error
        except serial.SerialException as error:
            cause = error.errno or getattr(error.__context__, "errno", None)
            raise OSError(cause or errno.EIO, str(error)) from error
        except ValueError as error:
            raise OSError(errno.EINVAL, str(error)) from error

    def _readable(self, descriptor: int, over: asyncio.Future[None]) -> None:
        try:
            data = os.read(descriptor, READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._end(over, error)
            return
        if data:
            self.receiver.received(self.address.device, data)
        else:
            self._end(over, OSError(errno.EIO, "end of file"))

    def _end(self, over: asyncio.Future[None], error: OSError) -> None:
        if self._port is not None:
            asyncio.get_running_loop().remove_reader(self._port.fileno())
        if not over.done():
            over.set_exception(error)

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        if self._port is None or len(self._waiting) > WAITING_LIMIT_BYTES:
            return False
        self._waiting += data
        self._write()
        return True

    def _write(self) -> None:
        """As much as the line takes; the event loop calls again when it takes more."""
        if self._port is None:
            return
        descriptor = self._port.fileno()
        loop = asyncio.get_running_loop()
        try:
            del self._waiting[: os.write(descriptor, self._waiting)]
        except BlockingIOError:
            pass
        except OSError:
            self._waiting.clear()  # The reader meets the same error and ends the connection.
        if self._waiting:
            loop.add_writer(descriptor, self._write)
        else:
            loop.remove_writer(descriptor)
