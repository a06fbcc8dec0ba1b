"""The agent's end of the sensor link: keeps connected, sends the newest frames, tells what became of them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import ssl
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from urllib.parse import urlsplit, urlunsplit

import msgspec
import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus, InvalidURI
from websockets.typing import Origin, Subprotocol

from mapping.geometry.arrays import F32
from mapping.sensor_frames import thinned
from telemetry.agent import link_messages as wire
from telemetry.agent.pacing import Bandwidth, RemoteClock
from telemetry.errors import AddressError, SensorLinkError

_log = logging.getLogger(__name__)

PING_EVERY_S = 1.0
OPEN_TIMEOUT_S = 10.0
AGAIN_S = (0.5, 1.0, 2.0, 5.0)
QUEUED_MAX = 64
REFUSED = frozenset({401, 403, 404})


@dataclass(frozen=True, slots=True)
class RadarReading:
    """``t_s``: on the agent's monotonic clock, as in all readings."""

    t_s: float
    targets: F32
    """(N, 5) x, y, z in the body frame, radial speed, SNR in dB"""
    lost: int = 0
    """Frames that the sensor sent before it and that never came: they count as lost at the ground station, too."""


@dataclass(frozen=True, slots=True)
class CloudReading:
    t_s: float
    xyz_m: F32
    """(N, 3) body frame"""


@dataclass(frozen=True, slots=True)
class NoticeReading:
    """Words for the pilot, about the sensor itself."""

    t_s: float
    warning: bool
    text: str


Reading = RadarReading | CloudReading | wire.Slam | wire.Uwb | NoticeReading
"""``Slam`` and ``Uwb`` are readings as they are sent, but for their times and numbers."""


@dataclass(slots=True)
class AgentCounts:
    """Since the agent began."""

    sent: int = 0
    skipped: int = 0
    """Clouds for which the bandwidth did not suffice, and what was measured while there was no connection."""
    sent_bytes: int = 0
    connections: int = 0
    points_not_finite: int = 0
    points_out_of_reach: int = 0
    """Of clouds, left out on board: no numbers, or farther than the wire format reaches."""
    report: wire.ArrivalReport | None = None
    """The ground station's newest."""
    refused_why: str = ""
    """Why the ground station last refused something."""
    not_understood: int = 0
    """Messages of the ground station that this agent does not know; it goes on without them."""
    trouble: str = ""
    """Why there is no connection; empty while there is one."""
    numbers: dict[str, int] = field(default_factory=dict)


def sensor_url(address: str) -> tuple[str, str]:
    """The WebSocket's address and the origin to name, of ``http(s)://host:port`` or ``ws(s)://host:port``.

    Raises AddressError.
    """
    parts = urlsplit(address)
    secure = {"http": False, "ws": False, "https": True, "wss": True}.get(parts.scheme)
    try:
        known = secure is not None and bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:
        known = False
    if not known:
        raise AddressError(
            f'"{address}" is no ground station.', where="sensor link", advice="Write http://HOST:PORT or https://HOST."
        )
    web, socket = ("https", "wss") if secure else ("http", "ws")
    return urlunsplit((socket, parts.netloc, wire.PATH, "", "")), f"{web}://{parts.netloc}"


class Agent:
    """``put`` readings from the same event loop; ``run`` until cancelled. What cannot be sent in time is left out."""

    def __init__(
        self, address: str, *, token: str, name: str, voxel_m: float = 0.25, limit_bytes_per_s: float = 1e6
    ) -> None:
        self._url, self._origin = sensor_url(address)
        self._token, self._name, self._voxel_m = token, name, voxel_m
        self._clock = RemoteClock()
        self._bandwidth = Bandwidth(limit_bytes_per_s, now_s=time.monotonic())
        self._queue: asyncio.Queue[Reading] = asyncio.Queue(QUEUED_MAX)
        self._connected = False
        self.counts = AgentCounts()

    @property
    def is_ready(self) -> bool:
        """Connected, and the ground station's clock is known: only then is anything sent."""
        return self._connected and self._clock.is_known

    def put(self, reading: Reading) -> None:
        """The oldest gives way when the queue is full: old obstacles help nobody."""
        if not self.is_ready:
            self._skip(reading)
            return
        if self._queue.full():
            self._skip(self._queue.get_nowait())
        self._queue.put_nowait(reading)

    async def run(self) -> None:
        """Connects, and again whenever the connection is lost. Raises SensorLinkError when the token is refused."""
        failures = 0
        while True:
            try:
                async with self._connection() as connection:
                    failures = 0
                    await self._talk(connection)
            except (OSError, TimeoutError, InvalidHandshake, ConnectionClosed) as error:
                self._trouble(error)
            wait_s = AGAIN_S[min(failures, len(AGAIN_S) - 1)]
            failures += 1
            await asyncio.sleep(wait_s)

    @contextlib.asynccontextmanager
    async def _connection(self) -> AsyncIterator[ClientConnection]:
        context = ssl.create_default_context() if self._url.startswith("wss") else None
        try:
            opening = connect(
                self._url,
                origin=Origin(self._origin),
                additional_headers={"Authorization": f"Bearer {self._token}"},
                subprotocols=[Subprotocol(wire.SUBPROTOCOL)],
                compression=None,
                open_timeout=OPEN_TIMEOUT_S,
                ssl=context,
                proxy=None,
            )
            async with opening as connection:
                yield connection
        except InvalidURI as error:
            raise AddressError(f"{self._url} is no address.", where="sensor link") from error
        except InvalidStatus as error:
            if error.response.status_code in REFUSED:
                raise SensorLinkError(
                    "The ground station refused this agent.",
                    where=self._url,
                    advice="Give it the token that the ground station shows, and the address that its page has.",
                ) from error
            raise

    async def _talk(self, connection: ClientConnection) -> None:
        await connection.send(wire.encode(wire.Hello(wire.PROTOCOL_VERSION, self._name)))
        self.counts.connections += 1
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self._listen(connection))
                group.create_task(self._ping(connection))
                group.create_task(self._send(connection))
        except* ConnectionClosed as closed:
            raise closed.exceptions[0] from None
        finally:
            self._connected = False
            while not self._queue.empty():
                self._skip(self._queue.get_nowait())

    async def _listen(self, connection: ClientConnection) -> None:
        async for data in connection:
            try:
                message = wire.decode_from_server(data.encode() if isinstance(data, str) else data)
            except SensorLinkError:
                self.counts.not_understood += 1
                continue
            match message:
                case wire.Welcome():
                    self._connected, self.counts.trouble = True, ""
                case wire.Pong(asked_s, server_s):
                    self._clock.on_answer(asked_s=asked_s, remote_s=server_s, now_s=time.monotonic())
                case wire.ArrivalReport():
                    self.counts.report = message
                    self.counts.refused_why = message.text or self.counts.refused_why
        raise ConnectionClosed(connection.protocol.close_rcvd, connection.protocol.close_sent)

    async def _ping(self, connection: ClientConnection) -> None:
        """Often at first: nothing is sent before the ground station's clock is known."""
        for number in range(1 << 62):
            await connection.send(wire.encode(wire.Ping(time.monotonic())))
            await asyncio.sleep(0.05 if number < 10 else PING_EVERY_S)

    async def _send(self, connection: ClientConnection) -> None:
        while True:
            reading = await self._queue.get()
            if isinstance(reading, CloudReading):
                data = await asyncio.to_thread(self._packed, reading)
                if not self._bandwidth.takes(len(data), time.monotonic()):
                    self.counts.skipped += 1
                    continue
            else:
                data = self._packed(reading)
                self._bandwidth.spend(len(data), time.monotonic())
            await connection.send(data)
            self.counts.sent += 1
            self.counts.sent_bytes += len(data)

    def _packed(self, reading: Reading) -> bytes:
        t_s = self._clock.remote_s(reading.t_s)
        if isinstance(reading, wire.Slam):
            return wire.encode(msgspec.structs.replace(reading, t_s=t_s))
        if isinstance(reading, NoticeReading):
            return wire.encode(wire.Notice(reading.warning, reading.text[: wire.NOTICE_LONGEST]))
        number = self._number(reading)
        if isinstance(reading, wire.Uwb):
            return wire.encode(msgspec.structs.replace(reading, number=number, t_s=t_s))
        if isinstance(reading, RadarReading):
            return wire.encode(
                wire.RadarMessage(number, t_s, np.ascontiguousarray(reading.targets, dtype="<f4").tobytes())
            )
        points, not_finite, out_of_reach = wire.sendable(reading.xyz_m, wire.REACH_M)
        self.counts.points_not_finite += not_finite
        self.counts.points_out_of_reach += out_of_reach
        return wire.encode(wire.cloud(thinned(points, self._voxel_m), number=number, t_s=t_s, voxel_m=self._voxel_m))

    def _number(self, reading: Reading) -> int:
        """Counted also for what is left out, so that the ground station sees the gap."""
        kind = type(reading).__name__
        lost = reading.lost if isinstance(reading, RadarReading) else 0
        self.counts.numbers[kind] = self.counts.numbers.get(kind, -1) + 1 + lost
        return self.counts.numbers[kind]

    def _skip(self, reading: Reading) -> None:
        self._number(reading)
        self.counts.skipped += 1

    def _trouble(self, error: BaseException) -> None:
        text = str(error) or type(error).__name__
        if text != self.counts.trouble:
            _log.warning("No connection to %s: %s", self._url, text)
        self.counts.trouble = text
