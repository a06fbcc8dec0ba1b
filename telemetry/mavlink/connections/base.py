"""What all connections share: they keep themselves open, and say why when they cannot."""

from __future__ import annotations

import asyncio
import errno
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from telemetry.errors import ConnectionFailedError, TelemetryError
from telemetry.mavlink.address import Address

Peer = str
"""Host and port of the far end, or the serial device."""

RETRY_S = (0.2, 0.5, 1.0)
"""Pauses before it is tried again; never none, so that a far end that hangs up at once costs no processor."""
SEND_LIMIT_BYTES = 64 * 1024
"""What may wait for a slow line. Beyond that frames are dropped: a command that is seconds late is worse than none."""


@dataclass(frozen=True, slots=True)
class Receiver:
    """Whom a connection tells, all on the event loop and without waiting."""

    received: Callable[[Peer, bytes], None]
    gone: Callable[[Peer], None]
    """The far end hung up; what it had sent half is not continued."""
    changed: Callable[[], None]
    """``state`` or ``error`` is another one."""


class Connection(ABC):
    """One way to vehicles. ``run`` opens it and opens it again until it is cancelled."""

    datagrams = False
    """Each ``received`` is a whole datagram, not a piece of a stream."""

    def __init__(self, address: Address, receiver: Receiver) -> None:
        self.address = address
        self.receiver = receiver
        self.state: Literal["open", "failed"] = "failed"
        self.error: TelemetryError | None = None
        self.times_opened = 0

    @abstractmethod
    async def _stay_open(self) -> None:
        """Opens, calls ``_opened``, returns or raises OSError when it is over. Closes what it opened in any case."""

    @abstractmethod
    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        """Never waits. ``peer`` None: the far end that the address names. False: dropped."""

    async def run(self) -> None:
        failures = 0
        while True:
            opened_before = self.times_opened
            try:
                await self._stay_open()
            except OSError as error:
                self._fail(described(error, self.address))
            else:
                self._fail(hung_up(self.address))
            failures = 0 if self.times_opened > opened_before else failures + 1
            await asyncio.sleep(RETRY_S[min(failures, len(RETRY_S) - 1)])

    def _opened(self) -> None:
        self.state, self.error = "open", None
        self.times_opened += 1
        self.receiver.changed()

    def _fail(self, error: TelemetryError) -> None:
        changed = self.state != "failed" or self.error is None or self.error.what != error.what
        self.state, self.error = "failed", error
        if changed:
            self.receiver.changed()


def hung_up(address: Address) -> ConnectionFailedError:
    return ConnectionFailedError(
        "The far end closed the connection.", where=address.text, advice="It is tried again by itself."
    )


def described(error: OSError, address: Address) -> ConnectionFailedError:
    """What went wrong in words for the pilot, and what to do."""
    what, advice = _CAUSES.get(error.errno or 0, (None, None))
    if what is None:
        what, advice = f"The connection failed: {error.strerror or error}.", "It is tried again by itself."
    place = address.device if address.kind == "serial" else f"port {address.port}"
    if address.kind == "serial" and error.errno in (errno.EAGAIN, errno.EBUSY):
        what, advice = "{place} is in use.", "Another ground station has it open: close that one."
    what = what.format(place=place[:1].upper() + place[1:])
    return ConnectionFailedError(what, where=address.text, advice=advice or "")


_CAUSES: dict[int, tuple[str, str]] = {
    errno.EADDRINUSE: (
        "{place} is in use.",
        "Another ground station is probably open: close it, or take another port.",
    ),
    errno.EADDRNOTAVAIL: ("This machine has no such network address.", "Listen on 0.0.0.0 to take every network."),
    errno.EACCES: ("{place} may not be opened.", "Take a port above 1023; for a serial device join the group dialout."),
    errno.EPERM: ("{place} may not be opened.", "Ask who administers this machine."),
    errno.ENOENT: ("{place} is not there.", "Plug the device in: it is tried again by itself."),
    errno.ENXIO: ("{place} is not there.", "Plug the device in: it is tried again by itself."),
    errno.ENODEV: ("{place} is not there.", "Plug the device in: it is tried again by itself."),
    errno.EIO: ("{place} was unplugged.", "Plug it in again: it is tried again by itself."),
    errno.ECONNREFUSED: ("{place} does not answer.", "Start the vehicle's side: it is tried again by itself."),
    errno.ECONNRESET: ("The far end closed the connection.", "It is tried again by itself."),
    errno.EHOSTUNREACH: ("The host cannot be reached.", "Check the network: it is tried again by itself."),
    errno.ENETUNREACH: ("The host cannot be reached.", "Check the network: it is tried again by itself."),
    errno.ETIMEDOUT: ("The host does not answer.", "Check the network: it is tried again by itself."),
}
