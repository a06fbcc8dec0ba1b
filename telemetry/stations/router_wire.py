"""The way to the router: a second Zenoh session, as a client over TLS, beside the bus and apart from it.

Both ends show certificates. No multicast, no gossip, no listening: nothing but the routers that are named is spoken to.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh

from telemetry.errors import StationsError
from telemetry.stations.recordings.asked_and_given import MESSAGE_BYTES, meant_for
from telemetry.stations.router_file import LEASE_MS
from telemetry.stations.station_messages import BEACON_BYTES
from telemetry.stations.station_names import EVERYTHING, MOST_STATIONS, MOST_VEHICLES
from telemetry.stations.station_proof import Route, read_proof

CONNECT_S = 3.0
_MOST_WAITING = MOST_STATIONS * (2 * MOST_VEHICLES + 1)
_MOST_MAIL = 512
_SETTINGS: dict[str, Any] = {
    "mode": "client",
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "timestamping/enabled": False,
    "transport/shared_memory/enabled": False,
    "transport/link/protocols": ["tls"],
    "transport/link/rx/max_message_size": 65_536,
    "transport/link/tx/lease": LEASE_MS,
    "transport/link/tls/enable_mtls": True,
    "transport/link/tls/verify_name_on_connect": True,
    "transport/link/tls/close_link_on_expiration": True,
    # What cannot leave at once is old by the time it could: the next word of the vehicle counts.
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
    "transport/link/tx/queue/size/data": 2,
    "connect/timeout_ms": round(1000 * CONNECT_S),
    "connect/exit_on_failure": True,
    # After it was once connected, Zenoh itself connects again.
    "connect/retry": {"period_init_ms": 500, "period_max_ms": 2000, "period_increase_factor": 1.5},
}


class Inbox:
    """Filled by Zenoh's threads, emptied by the event loop: of each key the newest waits, of a bounded number of keys.

    ``refused``: messages that were too long, or of more keys than there are stations and vehicles.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._lock = threading.Lock()
        self._waiting: dict[str, tuple[bytes, float]] = {}
        self._refused = 0

    def offer(self, key: str, payload: zenoh.ZBytes | bytes, came_mono_s: float) -> None:
        with self._lock:
            if len(payload) > BEACON_BYTES or (key not in self._waiting and len(self._waiting) >= _MOST_WAITING):
                self._refused += 1
                return
            was_empty = not self._waiting
            self._waiting[key] = bytes(payload), came_mono_s
        if was_empty:
            self._wake()

    def take(self) -> tuple[dict[str, tuple[bytes, float]], int]:
        """What waits, by key, with the time at which it came; and how many were refused since."""
        with self._lock:
            waiting, self._waiting = self._waiting, {}
            refused, self._refused = self._refused, 0
        return waiting, refused


class Mailbox:
    """Of messages about recordings each one waits, so many at most: of what is lost there is asked again."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._lock = threading.Lock()
        self._waiting: deque[tuple[str, bytes, float]] = deque()

    def offer(self, key: str, payload: zenoh.ZBytes | bytes, came_mono_s: float) -> None:
        with self._lock:
            if len(payload) > MESSAGE_BYTES or len(self._waiting) >= _MOST_MAIL:
                return
            was_empty = not self._waiting
            self._waiting.append((key, bytes(payload), came_mono_s))
        if was_empty:
            self._wake()

    def take(self) -> list[tuple[str, bytes, float]]:
        """Key, message, and when it came."""
        with self._lock:
            waiting, self._waiting = list(self._waiting), deque()
        return waiting


class Wire:
    """``inbox`` is filled and ``arrived`` set while the session is open; ``mail`` and ``mail_arrived`` by what is said
    about recordings to ``station``. All methods belong to the event loop."""

    def __init__(self, session: zenoh.Session, clock: Callable[[], float], station: str) -> None:
        self._session, self.arrived, self.mail_arrived = session, asyncio.Event(), asyncio.Event()
        self.inbox = inbox = Inbox(_waker(self.arrived))
        self.mail = mail = Mailbox(_waker(self.mail_arrived))
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._subscriber = session.declare_subscriber(
            EVERYTHING,
            lambda sample: inbox.offer(str(sample.key_expr), sample.payload, clock()),
            allowed_origin=zenoh.Locality.REMOTE,
        )
        self._mail_subscriber = session.declare_subscriber(
            meant_for(station),
            lambda sample: mail.offer(str(sample.key_expr), sample.payload, clock()),
            allowed_origin=zenoh.Locality.REMOTE,
        )

    @classmethod
    async def open(cls, route: Route, clock: Callable[[], float], station: str) -> Wire:
        """Raises StationsError where no router answers within ``CONNECT_S``, or one of the two refuses the other."""
        opening = asyncio.ensure_future(asyncio.to_thread(_opened, route))
        try:
            return cls(await asyncio.shield(opening), clock, station)
        except asyncio.CancelledError:
            with contextlib.suppress(StationsError):
                await asyncio.to_thread((await opening).close)
            raise

    def put(self, key: str, payload: bytes, *, waits: bool = False) -> None:
        """Never blocks: what finds no room is dropped. ``waits``: all else goes first, here and at the router."""
        publisher = self._publishers.get(key)
        if publisher is None:
            publisher = self._publishers[key] = self._session.declare_publisher(
                key,
                congestion_control=zenoh.CongestionControl.DROP,
                priority=zenoh.Priority.BACKGROUND if waits else zenoh.Priority.DATA,
                allowed_destination=zenoh.Locality.REMOTE,
            )
        publisher.put(payload)

    async def is_connected(self) -> bool:
        return bool(await asyncio.to_thread(self._session.info.routers_zid))

    async def close(self) -> None:
        await asyncio.to_thread(self._session.close)


def _waker(event: asyncio.Event) -> Callable[[], None]:
    """For Zenoh's threads."""
    loop = asyncio.get_running_loop()

    def wake() -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(event.set)

    return wake


def _opened(route: Route) -> zenoh.Session:
    proof = read_proof(route.file)
    tls = "transport/link/tls"
    settings: dict[str, Any] = {
        **_SETTINGS,
        "connect/endpoints": list(route.routers),
        f"{tls}/connect_private_key_base64": base64.b64encode(proof.key_pem).decode(),
        f"{tls}/connect_certificate_base64": base64.b64encode(proof.certificate_pem).decode(),
        f"{tls}/root_ca_certificate_base64": base64.b64encode(proof.authority_pem).decode(),
    }
    config = zenoh.Config()
    try:
        for name, value in settings.items():
            config.insert_json5(name, json.dumps(value))
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise StationsError(
            f"No router answers at {', '.join(route.routers)}, or it and this station refuse each other.",
            where=str(route.file),
            advice="Start the router, see that the network leads to it, and that its certificate is for that name.",
        ) from error
