"""Who publishes what in one domain, as liveliness tokens tell. Written by Zenoh's threads, read by any."""

from __future__ import annotations

import threading
from collections import Counter, defaultdict
from dataclasses import dataclass

from telemetry.ros2.grammar import Endpoint, GrammarError, gid_of, read_token

MOST_TOKENS = 20_000
"""More are counted, and not kept."""


@dataclass(frozen=True, slots=True)
class TopicFound:
    """One topic with one type."""

    name: str
    type: str
    hashes: tuple[str, ...]
    """Of those who publish it; of its subscriptions where nobody does."""
    publishers: tuple[str, ...]
    """Their nodes' names."""
    subscriptions: int
    keeps: bool
    """Whether a publisher hands its last messages to who comes late."""


class Graph:
    """The endpoints that are there at present."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._endpoints: dict[str, Endpoint] = {}
        self._sessions: dict[bytes, str] = {}
        """By a publisher's GID."""
        self._refused = Counter[str]()

    def on_token(self, text: str, is_there: bool) -> None:
        try:
            endpoint = read_token(text)
        except GrammarError:
            with self._lock:
                self._refused["tokens"] += 1
            return
        with self._lock:
            if not is_there:
                self._endpoints.pop(text, None)
                self._sessions.pop(gid_of(text), None)
            elif endpoint is not None and len(self._endpoints) < MOST_TOKENS:
                self._endpoints[text] = endpoint
                self._sessions[gid_of(text)] = endpoint.session
            elif endpoint is not None:
                self._refused["too many tokens"] += 1

    @property
    def refused(self) -> dict[str, int]:
        """Tokens that were not kept, by reason."""
        with self._lock:
            return dict(self._refused)

    def publishers(self, topic: str) -> list[Endpoint]:
        with self._lock:
            return [each for each in self._endpoints.values() if each.kind == "MP" and each.key.topic == topic]

    def session_of(self, topic: str, gid: bytes) -> str | None:
        """Of who published a message; None where tokens leave it open."""
        with self._lock:
            if (known := self._sessions.get(gid)) is not None:
                return known
        sessions = {each.session for each in self.publishers(topic)}
        return sessions.pop() if len(sessions) == 1 else None

    def topics(self) -> list[TopicFound]:
        """By name and type."""
        grouped: dict[tuple[str, str], list[Endpoint]] = defaultdict(list)
        with self._lock:
            for each in self._endpoints.values():
                grouped[each.key.topic, each.key.type].append(each)
        return [_found(name, kind, several) for (name, kind), several in sorted(grouped.items())]


def _found(name: str, kind: str, several: list[Endpoint]) -> TopicFound:
    telling = [each for each in several if each.kind == "MP"]
    hashes = sorted({each.key.hash for each in telling or several})
    nodes = sorted({each.node for each in telling})
    return TopicFound(
        name, kind, tuple(hashes), tuple(nodes), len(several) - len(telling), any(each.keeps for each in telling)
    )
