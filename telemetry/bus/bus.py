"""One process's place on the bus: it publishes, subscribes, answers calls and makes them."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Self, TypeVar

import zenoh

from telemetry.bus import encoding
from telemetry.bus.calls import Answers, call
from telemetry.bus.sockets import remove_socket, socket_directory
from telemetry.bus.subscription import Subscription
from telemetry.bus.zenoh_session import open_session
from telemetry.errors import BusError
from telemetry.topics.messages import Published

T = TypeVar("T")

_LIVE = "live/"
_LAST = "last/"
_HERE = "here/"
_LARGE = 256_000
"""bytes from which on a kept message is announced and fetched, because the way of live messages may drop it"""


class Bus:
    """All methods belong to one event loop; Zenoh's own threads stay behind it.

    Each publisher keeps its last message of every topic that is no stream of events, and hands it to whoever
    subscribes late. Publishers may come later than their subscribers, and again after they died.
    A process ends only after ``close``: Zenoh's threads are waited for.
    """

    def __init__(self, session: zenoh.Session, runtime_dir: Path, folder: Path, name: str) -> None:
        self.name, self.runtime_dir = name, runtime_dir
        self._session = session
        self._folder = folder
        self._last: dict[str, tuple[bytes, int]] = {}
        self._stamp = 0
        self._subscriptions: dict[Subscription, zenoh.Subscriber[None]] = {}
        self._lock = threading.Lock()
        self._answers: list[Answers] = []
        self._closed = False
        # Zenoh ends what nobody refers to. Who sees the token asks for the last messages, so the token comes last.
        liveliness = session.liveliness()
        self._declared = (
            session.declare_queryable(f"{_LAST}{name}/**", self._on_asked_for_last),
            liveliness.declare_subscriber(f"{_HERE}*", self._on_neighbour, history=True),
            liveliness.declare_token(f"{_HERE}{name}"),
        )

    @classmethod
    async def open(cls, runtime_dir: Path, name: str) -> Bus:
        """Joins the bus of ``runtime_dir``. Nobody else needs to be there.

        Raises BusError when the directory is not ours alone or the name is taken by a living process.
        """
        if not name.replace("-", "").replace("_", "").isalnum() or not name.isascii() or len(name) > 20:
            raise BusError(
                f"{name!r} cannot be a name on the bus.",
                advice="Use up to 20 letters, digits, hyphens and underscores.",
            )
        folder = socket_directory(runtime_dir)
        return cls(await asyncio.to_thread(open_session, folder, name), runtime_dir, folder, name)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_exc: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Ends all subscriptions and cancels requests that are being answered. May be called twice."""
        if self._closed:
            return
        self._closed = True
        for subscription in list(self._subscriptions):
            subscription.close()
        for answers in self._answers:
            await answers.close()
        await asyncio.to_thread(self._session.close)
        remove_socket(self._folder, self.name)

    def publish(self, topic: str, message: Published) -> None:
        """Never blocks: a reader that has stopped reading loses messages, nobody else does."""
        payload = encoding.encode_message(topic, message)
        self._need_open()
        # Monotonic time is the same for all processes here: a restarted publisher's messages count as newer.
        self._stamp = max(self._stamp + 1, time.monotonic_ns())
        if encoding.is_kept(topic):
            self._last[topic] = (payload, self._stamp)
        announced = encoding.is_kept(topic) and len(payload) > _LARGE
        self._session.put(
            _LIVE + topic,
            b"" if announced else payload,
            attachment=_attachment(self._stamp, self.name if announced else ""),
            congestion_control=zenoh.CongestionControl.DROP,
        )

    def subscribe(self, pattern: str, *, keep_all: bool = False, limit: int = 1000) -> Subscription:
        """``pattern`` is a topic, or has ``*`` for one part and ``**`` for any number of parts of a topic.

        It starts with the last message of each kept topic, from each publisher that is there or comes later.
        """
        self._need_open()
        subscription = Subscription(pattern, keep_all=keep_all, limit=limit, undeclare=self._undeclare)
        zenoh_side = self._session.declare_subscriber(
            _LIVE + pattern, lambda sample: self._on_live(subscription, sample)
        )
        with self._lock:
            self._subscriptions[subscription] = zenoh_side
        self._ask_for_last(subscription, f"*/{pattern}")
        return subscription

    async def serve(self, name: str, handler: Callable[[Any], Awaitable[object]], requests: Any) -> None:
        """Answers the calls to ``name`` from now on, several at a time, each in a task of its own.

        ``requests`` is a dataclass or a union of dataclasses. What the handler returns is the answer; a
        DescribedError reaches the caller as it is, any other exception is logged here and named nowhere else.
        """
        self._need_open()
        self._answers.append(Answers(self._session, name, handler, requests))

    async def call(
        self, name: str, request: object, *, result: type[T], timeout_s: float = 5.0, appears_s: float = math.inf
    ) -> T:
        """Asks once and waits for the answer; at most ``appears_s`` for ``name`` to appear, if it is not there yet.

        Raises the DescribedError that the handler raised; BusError when ``name`` does not appear, goes away or does
        not answer in time. A request that was cut off may have been carried out.
        """
        self._need_open()
        return await call(self._session, name, request, result, timeout_s, appears_s)

    def _need_open(self) -> None:
        if self._closed:
            raise BusError(f"{self.name} has left the bus.")

    def _undeclare(self, subscription: Subscription) -> None:
        with self._lock:
            zenoh_side = self._subscriptions.pop(subscription)
        zenoh_side.undeclare()

    # From here on: called by Zenoh's threads.

    def _on_asked_for_last(self, query: zenoh.Query) -> None:
        with query:
            for topic, (payload, stamp) in list(self._last.items()):
                key = zenoh.KeyExpr(f"{_LAST}{self.name}/{topic}")
                if query.key_expr.intersects(key):
                    query.reply(key, payload, attachment=_attachment(stamp))

    def _on_neighbour(self, sample: zenoh.Sample) -> None:
        if sample.kind != zenoh.SampleKind.PUT:
            return
        publisher = str(sample.key_expr).removeprefix(_HERE)
        with self._lock:
            subscriptions = list(self._subscriptions)
        for subscription in subscriptions:
            self._ask_for_last(subscription, f"{publisher}/{subscription.pattern}")

    def _on_live(self, subscription: Subscription, sample: zenoh.Sample) -> None:
        topic = str(sample.key_expr).removeprefix(_LIVE)
        stamp, announced_by = _read_attachment(sample)
        if announced_by:
            self._ask_for_last(subscription, f"{announced_by}/{topic}")
        else:
            subscription.offer(topic, sample.payload.to_bytes(), stamp)

    def _ask_for_last(self, subscription: Subscription, publisher_and_topic: str) -> None:
        self._session.get(
            _LAST + publisher_and_topic,
            lambda reply: _take_kept(subscription, reply),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )


def _take_kept(subscription: Subscription, reply: zenoh.Reply) -> None:
    if sample := reply.ok:  # else the publisher went away
        topic = str(sample.key_expr).split("/", 2)[2]
        subscription.offer(topic, sample.payload.to_bytes(), _read_attachment(sample)[0], kept=True)


def _attachment(stamp: int, announced_by: str = "") -> bytes:
    return stamp.to_bytes(8, "big") + announced_by.encode()


def _read_attachment(sample: zenoh.Sample) -> tuple[int, str]:
    raw = sample.attachment.to_bytes() if sample.attachment else b""
    return int.from_bytes(raw[:8], "big"), raw[8:].decode()
