"""Tells ROS 2 what a running station knows: topics of a node of our own, for `ros2 topic list` and `echo` to find."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import Counter
from collections.abc import Callable

from telemetry.bus.bus import Bus
from telemetry.bus.subscription import Subscription
from telemetry.errors import BusError
from telemetry.ros2 import grammar
from telemetry.ros2.outgoing import ALERTS_OUT, MAPS, OUT_TOPICS, VOXELS_OUT, Outgoing, OutTopic
from telemetry.ros2.wire import Ros2Publisher, Ros2Wire
from telemetry.topics.messages import Topic
from telemetry.topics.requests import WholeMap

NODE = "hedgehop"
MAPS_EVERY_S, ASK_S, LOOK_S = 1.0, 2.0, 0.5
_DEPTH = 10


class _OwnTopic:
    """One publisher of ours."""

    def __init__(self, wire: Ros2Wire, endpoint: grammar.Endpoint) -> None:
        token = grammar.endpoint_token(endpoint)
        self._publisher: Ros2Publisher = wire.publisher(
            str(endpoint.key), keeps=endpoint.depth if endpoint.keeps else 0
        )
        self._gid, self._sequence = grammar.gid_of(token), 0
        wire.tell(token)

    def put(self, payload: bytes) -> None:
        self._sequence += 1
        self._publisher.put(payload, grammar.Attachment(self._sequence, time.time_ns(), self._gid).packed())


class Ros2Teller:
    """``run`` until cancelled."""

    def __init__(
        self, wire: Ros2Wire, *, domain: int, namespace: str = NODE, is_humble: bool = False,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:  # fmt: skip
        """``is_humble``: humble's nodes know no hashes of types, and hear topics without one only; ``tell`` hears when
        the station falls silent, and when it is back."""
        self._said = tell
        self.counts = Counter[str]()
        """Messages by topic."""
        self._outgoing = Outgoing(time.monotonic())
        wire.tell(grammar.node_token(domain, wire.session_id, NODE))
        self._topics = {
            out: _OwnTopic(wire, self._endpoint(out, number, wire.session_id, domain, namespace, is_humble))
            for number, out in enumerate(OUT_TOPICS, start=1)
        }

    def _endpoint(
        self, out: OutTopic, number: int, session: str, domain: int, namespace: str, is_humble: bool
    ) -> grammar.Endpoint:
        digest = grammar.NO_HASH if is_humble else self._outgoing.hash_of(out.type)
        key = grammar.DataKey(domain, grammar.topic_name(f"{namespace}/{out.name}"), out.type, digest)
        return grammar.Endpoint("MP", session, f"/{NODE}", str(number), key, out.keeps > 0, out.keeps or _DEPTH)

    async def run(self, bus: Bus) -> None:
        async with asyncio.TaskGroup() as tasks:
            for topic in (Topic.VEHICLE, Topic.SERVER, Topic.ALERT):
                tasks.create_task(self._tell(bus.subscribe(topic, keep_all=topic == Topic.ALERT)))
            for topic in MAPS:
                tasks.create_task(self._tell(bus.subscribe(topic, keep_all=True)))
            tasks.create_task(self._tell_maps(bus))
            tasks.create_task(self._watch_station())

    async def _tell(self, heard: Subscription) -> None:
        async for topic, message in heard:
            found = self._outgoing.of(topic, message, now_mono_s=time.monotonic(), now_utc_s=time.time())
            for out, payload in found:
                self._put(out, payload)

    async def _watch_station(self) -> None:
        while True:
            await asyncio.sleep(LOOK_S)
            payload = self._outgoing.turned(now_mono_s=time.monotonic(), now_utc_s=time.time())
            if payload is not None:
                self._put(ALERTS_OUT, payload)
                gone = "The station is silent: alerts are told as STALE, and maps are as they were."
                self._said(gone if self._outgoing.is_silent else "The station gives signs again.")

    async def _tell_maps(self, bus: Bus) -> None:
        """Whole maps, once a second where they changed: each is made in a thread."""
        while True:
            for topic in sorted(self._outgoing.without_whole):
                with contextlib.suppress(BusError):  # that sensor's node does not run
                    await bus.call(MAPS[topic], WholeMap(), result=type(None), timeout_s=ASK_S, appears_s=0.0)
            await asyncio.sleep(MAPS_EVERY_S)
            for topic, deltas in list(self._outgoing.changed_maps()):
                self._put(VOXELS_OUT[topic], await asyncio.to_thread(self._outgoing.voxels, topic, deltas))

    def _put(self, out: OutTopic, payload: bytes) -> None:
        self._topics[out].put(payload)
        self.counts[out.name] += 1
