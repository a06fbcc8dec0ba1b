"""What a recording begins with: the state of everything, and what happened in the seconds before."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from telemetry.recording.recorded_topics import LATEST
from telemetry.topics.messages import Published

SECONDS = 5.0
_MOST = 20_000


class Stamped(NamedTuple):
    t_mono_s: float
    topic: str
    message: Published


class Preroll:
    """Bounded in time and number: the oldest go first."""

    def __init__(self) -> None:
        self._recent: deque[Stamped] = deque(maxlen=_MOST)
        self._latest: dict[str, Stamped] = {}

    def add(self, stamped: Stamped) -> None:
        self._recent.append(stamped)
        if stamped.topic in LATEST:
            self._latest[stamped.topic] = stamped
        while self._recent[0].t_mono_s < stamped.t_mono_s - SECONDS:
            self._recent.popleft()

    def take(self, now_s: float) -> list[Stamped]:
        """The latest of each state that did not change lately, then all of the last seconds, in order."""
        recent = [stamped for stamped in self._recent if stamped.t_mono_s >= now_s - SECONDS]
        start_s = recent[0].t_mono_s if recent else now_s
        told = {stamped.topic for stamped in recent}
        older = [Stamped(start_s, topic, s.message) for topic, s in self._latest.items() if topic not in told]
        return older + recent
