"""The one module here that knows Zenoh: a session to a router or peer of rmw_zenoh, and what goes over it.

Callbacks come from Zenoh's threads, and must not block. Only the endpoint that was named is reached: no scouting, no
gossip, no port of our own.
"""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import zenoh
import zenoh.ext

from telemetry.errors import Ros2Error
from telemetry.ros2.zenoh_endpoint import ZenohAddress

MOST_BYTES = 32_000_000
"""Of one message; more is counted, and not read."""
MOST_HISTORY = 100
"""Of a publisher that keeps its last messages."""
_SETTINGS: dict[str, Any] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "scouting/timeout": 1000,
    "listen/endpoints": [],
    # A publisher that keeps its last messages stamps them (rmw_zenoh sets this as well).
    "timestamping/enabled": True,
    "transport/shared_memory/enabled": False,
    "transport/link/protocols": ["tcp"],
    "transport/unicast/accept_timeout": 2000,
    "transport/link/rx/max_message_size": 2 * MOST_BYTES,
    "adminspace/enabled": False,
    "connect/timeout_ms": 2000,
    "connect/exit_on_failure": True,
    "connect/retry": {"period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 1.5},
}


@dataclass(frozen=True, slots=True)
class WireSample:
    """One message as it came."""

    key: str
    payload: bytes
    """Empty for one that is too large."""
    attachment: bytes
    """Empty for none."""
    size: int
    received_mono_s: float
    received_utc_s: float


class Ros2Publisher:
    """One topic of ours."""

    def __init__(self, zenoh_side: Any) -> None:
        self._zenoh_side = zenoh_side

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Never blocks: a reader that is behind loses messages."""
        self._zenoh_side.put(payload, attachment=attachment)


class Ros2Wire:
    """One session. Methods may be called from any thread; ``close`` ends all that was declared."""

    def __init__(self, session: zenoh.Session, changed: Callable[[bool], None]) -> None:
        self._session = session
        self._declared: list[Any] = []
        self._lock, self._transports = threading.Lock(), set[str]()
        self._changed = changed
        self._keep(session.info.declare_transport_events_listener(self._on_transport, history=True))

    @classmethod
    def open(cls, address: ZenohAddress, *, changed: Callable[[bool], None]) -> Self:
        """``changed`` hears when the router is there, and when it is gone: Zenoh itself goes on trying to reach it.

        Blocks for up to some seconds. Raises Ros2Error while nobody answers.
        """
        config = zenoh.Config()
        for key, value in _SETTINGS.items():
            config.insert_json5(key, json.dumps(value))
        config.insert_json5("mode", json.dumps(address.mode))
        config.insert_json5("connect/endpoints", json.dumps([address.endpoint]))
        try:
            return cls(zenoh.open(config), changed)
        except zenoh.ZError as error:
            raise Ros2Error(
                "No router of Zenoh answers there.",
                where=address.endpoint,
                advice="Start it (ros2 run rmw_zenoh_cpp rmw_zenohd), or name another one with --router.",
            ) from error

    @property
    def session_id(self) -> str:
        return str(self._session.zid())

    @property
    def is_connected(self) -> bool:
        with self._lock:
            return bool(self._transports)

    def subscribe(self, key: str, on_sample: Callable[[WireSample], None], *, asks_kept: bool) -> None:
        """``asks_kept``: with what publishers have kept, those that are there and those that come later. Nothing tells
        such a message from one of now: only for what holds whenever it was said."""

        def hear(sample: zenoh.Sample) -> None:
            on_sample(_sample(sample))

        if not asks_kept:
            self._keep(self._session.declare_subscriber(key, hear))
            return
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=MOST_HISTORY)
        self._keep(zenoh.ext.declare_advanced_subscriber(self._session, key, hear, history=history))

    def watch_tokens(self, pattern: str, on_token: Callable[[str, bool], None]) -> None:
        """``on_token`` hears each liveliness token that is there, comes (True) or goes (False)."""
        self._keep(
            self._session.liveliness().declare_subscriber(
                pattern,
                lambda sample: on_token(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT),
                history=True,
            )
        )

    def tell(self, token: str) -> None:
        """Declares a liveliness token that lives as long as this session."""
        self._keep(self._session.liveliness().declare_token(token))

    def publisher(self, key: str, *, keeps: int) -> Ros2Publisher:
        """``keeps``: so many last messages are handed to who comes late; 0: none."""
        cache = zenoh.ext.CacheConfig(max_samples=keeps) if keeps else None
        found = zenoh.ext.declare_advanced_publisher(
            self._session,
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            cache=cache,
            publisher_detection=bool(keeps) or None,
        )
        self._keep(found)
        return Ros2Publisher(found)

    def close(self) -> None:
        """May be called twice. Blocks until Zenoh's threads have ended."""
        with self._lock:
            declared, self._declared = self._declared, []
        for each in reversed(declared):
            with contextlib.suppress(zenoh.ZError):  # the session may have gone before it
                each.undeclare()
        if not self._session.is_closed():
            self._session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exc: object) -> None:
        self.close()

    def _keep(self, declared: Any) -> None:
        """Zenoh ends what nobody refers to."""
        with self._lock:
            self._declared.append(declared)

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        other = str(event.transport.zid)
        with self._lock:
            before = bool(self._transports)
            (self._transports.add if event.kind == zenoh.SampleKind.PUT else self._transports.discard)(other)
            now = bool(self._transports)
        if now != before:
            self._changed(now)


def _sample(sample: zenoh.Sample) -> WireSample:
    size = len(sample.payload)
    attachment = sample.attachment
    return WireSample(
        str(sample.key_expr),
        sample.payload.to_bytes() if size <= MOST_BYTES else b"",
        b"" if attachment is None or len(attachment) > 256 else attachment.to_bytes(),
        size,
        time.monotonic(),
        time.time(),
    )
