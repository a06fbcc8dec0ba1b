"""Topics of ROS 2 heard: each message decoded, with what it took to come; what cannot be read is counted, by reason."""

from __future__ import annotations

import math
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from telemetry.errors import Ros2Error
from telemetry.recording.ros.bag_types import POINT_TYPES, POSE_TYPES, TF
from telemetry.recording.ros.ros2_messages import Ros2Messages, UnreadableMessageError
from telemetry.ros2 import grammar
from telemetry.ros2.graph import Graph
from telemetry.ros2.wire import MOST_BYTES, Ros2Wire, WireSample
from telemetry.ros2.zenoh_endpoint import ZenohAddress

AGAIN_S = (0.5, 1.0, 2.0, 5.0)
MOST_REASONS, OTHER_REASONS = 200, "It cannot be read, for other reasons."
READ_TYPES = POINT_TYPES | POSE_TYPES | {TF}


@dataclass(frozen=True, slots=True)
class Heard:
    """One message."""

    topic: str
    type: str
    message: Any
    source_ns: int
    """When it was published, by its publisher's clock."""
    gid: bytes
    lost: int
    """Messages of this publisher before it that were not read: lost on the way, or dropped here."""
    received_mono_s: float
    received_utc_s: float


class Inbox:
    """What has come and was not worked on yet, one row for each name; who is slow loses the oldest.

    ``put`` never blocks; ``take`` empties rows by turns, so that none waits for ever.
    """

    def __init__(self, most: Mapping[str, int]) -> None:
        """``most``: how many wait under each name."""
        self._rows: dict[str, deque[WireSample]] = {name: deque(maxlen=count) for name, count in most.items()}
        self._ready, self._next = threading.Condition(), 0
        self.dropped = dict.fromkeys(most, 0)
        """By name: that were not taken in time."""

    def put(self, name: str, sample: WireSample) -> None:
        with self._ready:
            row = self._rows[name]
            self.dropped[name] += len(row) == row.maxlen
            row.append(sample)
            self._ready.notify()

    def take(self, timeout_s: float) -> tuple[str, WireSample] | None:
        """The oldest of the next row that is not empty; None when nothing came in that time."""
        with self._ready:
            self._ready.wait_for(lambda: any(self._rows.values()), timeout_s)
            names = list(self._rows)
            for place in range(self._next, self._next + len(names)):
                name = names[place % len(names)]
                if row := self._rows[name]:
                    self._next = place % len(names) + 1
                    return name, row.popleft()
        return None


class Ros2Listener:
    """``hear`` from one thread; all else from any."""

    def __init__(self, domain: int, rows: Mapping[str, int], *, timeless: frozenset[str] = frozenset()) -> None:
        """``rows``: the topics, and how many messages of each wait at most; ``timeless``: those of which what was said
        before holds as well, and is asked for."""
        self.domain, self.topics, self._timeless = domain, tuple(rows), timeless
        self.since_mono_s = math.inf
        """When it began to listen."""
        self.graph, self.inbox = Graph(), Inbox(rows)
        self.is_connected = False
        self.interruptions = 0
        self.lost = dict.fromkeys(rows, 0)
        self.refused = Counter[tuple[str, str]]()
        """By topic and reason; the latter says what is wrong."""
        self._messages = Ros2Messages()
        self._known_hash: dict[str, str] = {}
        self._sequences: dict[tuple[str, bytes], int] = {}
        self._wire: Ros2Wire | None = None
        self._closed = threading.Event()

    def open(self, address: ZenohAddress, *, tell: Callable[[str], None]) -> None:
        """Blocks until somebody answers at the address, trying again; ``tell`` hears why it takes long."""
        failures = 0
        while not self._closed.is_set():
            try:
                self._wire = Ros2Wire.open(address, changed=self._on_connection)
                break
            except Ros2Error as error:
                if failures == 0:
                    tell(f"{error} It is tried again.")
                self._closed.wait(AGAIN_S[min(failures, len(AGAIN_S) - 1)])
                failures += 1
        if self._wire is not None:
            self._wire.watch_tokens(grammar.all_tokens(self.domain), self.graph.on_token)
            self.since_mono_s = time.monotonic()
            for topic in self.topics:
                self._subscribe(self._wire, topic)

    def close(self) -> None:
        self._closed.set()
        if self._wire is not None:
            self._wire.close()

    @property
    def is_closed(self) -> bool:
        return self._closed.is_set()

    def hear(self, timeout_s: float) -> Heard | None:
        """The next message that can be read; None when none came in that time."""
        until_s = time.monotonic() + timeout_s
        while True:
            taken = self.inbox.take(max(0.0, until_s - time.monotonic()))
            if taken is None:
                return None
            topic, sample = taken
            try:
                return self._read(topic, sample)
            except (Ros2Error, UnreadableMessageError) as error:
                why = error.what if isinstance(error, Ros2Error) else str(error)
                self._refuse(topic, why[:200])

    def _subscribe(self, wire: Ros2Wire, topic: str) -> None:
        key = grammar.any_type_key(self.domain, topic)
        wire.subscribe(key, lambda sample: self.inbox.put(topic, sample), asks_kept=topic in self._timeless)

    def _on_connection(self, is_there: bool) -> None:
        self.interruptions += self.is_connected and not is_there
        self.is_connected = is_there

    def _refuse(self, topic: str, why: str) -> None:
        """A reason may hold what came: no stranger fills our memory with it."""
        is_new = (topic, why) not in self.refused
        self.refused[topic, OTHER_REASONS if is_new and len(self.refused) >= MOST_REASONS else why] += 1

    def _read(self, topic: str, sample: WireSample) -> Heard:
        if sample.size > MOST_BYTES:
            raise Ros2Error(f"A message is larger than {MOST_BYTES / 1e6:.0f} MB.")
        if not sample.attachment:
            raise Ros2Error("A message has no attachment: it is not of rmw_zenoh.")
        key, beside = grammar.read_key(sample.key), grammar.read_attachment(sample.attachment)
        if key.type not in READ_TYPES:
            raise Ros2Error(f"{key.type} is no type that can be read.")
        self._check_hash(key)
        message = self._messages.decoded(sample.payload, key.type, is_humble=key.hash == grammar.NO_HASH)
        lost = self._gap(topic, beside)
        self.lost[topic] += lost
        return Heard(
            topic, key.type, message, beside.source_ns, beside.gid, lost, sample.received_mono_s, sample.received_utc_s
        )

    def _check_hash(self, key: grammar.DataKey) -> None:
        if key.type not in self._known_hash:
            self._known_hash[key.type] = self._messages.hash_of(key.type)
        if key.hash not in (self._known_hash[key.type], grammar.NO_HASH):
            raise Ros2Error(f"The definition of {key.type} there is another one: its hash is {key.hash[:19]}...")

    def _gap(self, topic: str, beside: grammar.Attachment) -> int:
        """Numbers count up by one for each publisher; a smaller one is a publisher that began anew."""
        last = self._sequences.get((topic, beside.gid))
        if len(self._sequences) > 1000:
            self._sequences.clear()
        self._sequences[topic, beside.gid] = beside.sequence
        gap = 0 if last is None else beside.sequence - last - 1
        return gap if 0 < gap < 10_000 else 0
