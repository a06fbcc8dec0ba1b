"""Watches the topics that are read: nobody publishes one, it fell silent, it cannot be read, the router is gone."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping

from telemetry.ros2.listener import Ros2Listener
from telemetry.ros2.message_times import LARGE_OFFSET_S
from telemetry.ros2.topic_faults import Words

LOOK_EVERY_S = 0.25
APPEARS_S = 3.0
"""Until it counts as missing that nobody publishes a topic."""
SILENT_S = 2.0
"""Without a message of a topic of which one had come."""
_MOST_LISTED = 8


class TopicWatch:
    """``look`` often, from the thread that hears the topics."""

    def __init__(
        self,
        listener: Ros2Listener,
        words: Words,
        needed: Mapping[str, frozenset[str]],
        *,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """``needed``: topics, and the types that they must have."""
        self._listener, self._words, self._needed, self._now = listener, words, needed, now
        self._looked_s, self._connected_s = -math.inf, math.nan
        self._came_s: dict[str, float] = {}
        self._offsets: dict[str, float] = {}
        self._published_s: dict[str, float] = {}
        """Since when somebody publishes a topic, as is needed, of which nothing has come."""
        self._refused: dict[tuple[str, str], int] = {}

    def came(self, topic: str) -> None:
        """A message of it could be read."""
        self._came_s[topic] = self._now()
        self._words.ends(f"silent {topic}", f"{topic}: messages come again.")

    def offset(self, topic: str, offset_s: float) -> None:
        """Of its publisher's clock; said when it is large, and when it has changed by as much."""
        if abs(offset_s - self._offsets.get(topic, 0.0)) >= LARGE_OFFSET_S:
            self._offsets[topic] = offset_s
            side = "behind" if offset_s > 0 else "ahead of"
            self._words.note(f"{topic}: its clock is {abs(offset_s):.2f} s {side} ours; times are corrected by that.")

    def look(self) -> None:
        if self._now() - self._looked_s < LOOK_EVERY_S:
            return
        self._looked_s = self._now()
        self._look_at_refused()
        if not self._look_at_router():
            return
        for topic, types in self._needed.items():
            self._look_at_topic(topic, types)

    def _look_at_router(self) -> bool:
        if not self._listener.is_connected:
            if not math.isnan(self._connected_s):
                advice = "Nothing comes until it is back; it is tried again."
                self._words.begins("router", "The router is gone.", advice)
            self._connected_s = math.nan
            return False
        if math.isnan(self._connected_s):
            self._connected_s = self._now()
            self._words.ends("router", "The router is back.")
        return True

    def _look_at_topic(self, topic: str, types: frozenset[str]) -> None:
        publishers = self._listener.graph.publishers(topic)
        came_s = self._came_s.get(topic, -math.inf)
        is_young = self._now() - self._connected_s < APPEARS_S
        if any(each.key.type in types for each in publishers) or self._now() - came_s < SILENT_S:
            self._words.ends(f"nobody {topic}", f"{topic}: it is published.")
        elif publishers and not is_young:
            kinds = ", ".join(sorted({each.key.type for each in publishers})[:3])
            self._words.begins(
                f"nobody {topic}", f"{topic} is of {kinds}, which is not read there.", self._right(types)
            )
        elif not is_young:
            self._words.begins(f"nobody {topic}", f"Nobody publishes {topic}.", self._right(types))
        if SILENT_S <= self._now() - came_s < math.inf:
            self._words.begins(f"silent {topic}", f"{topic}: no message for {SILENT_S:.0f} s.")
        self._look_for_first(topic, is_right=any(each.key.type in types for each in publishers))

    def _look_for_first(self, topic: str, *, is_right: bool) -> None:
        """Somebody publishes it, and nothing comes: what was kept from before is not asked for."""
        if topic in self._came_s or not is_right:
            self._published_s.pop(topic, None)
        elif self._now() - self._published_s.setdefault(topic, self._now()) >= APPEARS_S:
            advice = "What was published before the agent came is not read: how old it is would not be known."
            self._words.begins(f"silent {topic}", f"{topic}: no message has come yet.", advice)

    def _right(self, types: frozenset[str]) -> str:
        right = [found.name for found in self._listener.graph.topics() if found.type in types and found.publishers]
        if right:
            return f"Topics of such types: {', '.join(right[:_MOST_LISTED])}."
        return f"No topic of domain {self._listener.domain} has such a type; see hedgehop ros2 topics."

    def _look_at_refused(self) -> None:
        for (topic, why), count in list(self._listener.refused.items()):
            if count != self._refused.get((topic, why)):
                self._refused[topic, why] = count
                self._words.recurs(f"{topic} cannot be read", f"{topic}: {why}")
