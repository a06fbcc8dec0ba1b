"""When a message was measured, on this machine's clocks, by its stamp and the time at which it was published.

A publisher's clock is known one way only: the shortest time that a message took bounds the offset from above. That
shortest way counts as none, so a frame is at most that much older than it is said to be.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

WINDOW_S = 30
"""Of messages by which the offset is judged."""
AGREE_S = 25
"""In so many different seconds of it messages must have come before a longer way than was known is believed."""
DRIFT = 1e-4
"""Of one clock against another, s/s: so much longer the way that was known may have become."""
LARGE_OFFSET_S = 0.1
"""From which on it is said."""
MOST_BEHIND_S, MOST_AHEAD_S = 2.0, 0.05
"""A stamp this far from when its message was published is of another clock: a simulation's, or a device's own."""
_BACK_S = 0.1
_MOST_PUBLISHERS, _MOST_SESSIONS = 1000, 100


@dataclass(frozen=True, slots=True)
class Measured:
    t_mono_s: float
    published_mono_s: float
    is_odd: bool
    """Its stamp tells another clock: it counts as measured when it was published."""


class StampClock:
    """One robot's clock, laid over our monotonic one: a step of our own clock of day changes nothing."""

    def __init__(self) -> None:
        self._shortest: deque[tuple[int, float]] = deque()
        """(second in which they were received, smallest monotonic time minus when published)"""
        self._known: tuple[float, float] | None = None
        """(when, the offset then): a silence, or late messages after it, do not undo it."""
        self._published_s: dict[bytes, float] = {}
        self._mono_minus_utc_s = 0.0

    @property
    def offset_s(self) -> float:
        """Our clock of day minus the publisher's; 0 before the first message."""
        return 0.0 if self._known is None else self._known[1] - self._mono_minus_utc_s

    def on_message(
        self, *, stamp_ns: int, source_ns: int, received_mono_s: float, received_utc_s: float, gid: bytes = b""
    ) -> Measured:
        """``stamp_ns`` of its header, 0 for none; ``source_ns`` and ``gid``, the publisher, of its attachment."""
        source_s = source_ns / 1e9
        if source_s < self._published_s.get(gid, 0.0) - _BACK_S or len(self._published_s) > _MOST_PUBLISHERS:
            self._set_back()
        self._published_s[gid], self._mono_minus_utc_s = source_s, received_mono_s - received_utc_s
        published_mono_s = source_s + self._offset(received_mono_s, received_mono_s - source_s)
        behind_s = (source_ns - stamp_ns) / 1e9 if stamp_ns else 0.0
        is_odd = not -MOST_AHEAD_S <= behind_s <= MOST_BEHIND_S
        t_mono_s = published_mono_s - (0.0 if is_odd else behind_s)
        return Measured(min(received_mono_s, t_mono_s), published_mono_s, is_odd)

    def _set_back(self) -> None:
        self._shortest.clear()
        self._published_s.clear()
        self._known = None

    def _offset(self, received_mono_s: float, mono_minus_source_s: float) -> float:
        """Monotonic time minus the publisher's, as far as is known with this message."""
        second = int(received_mono_s)
        if self._shortest and self._shortest[-1][0] >= second:
            newest, shortest = self._shortest[-1]
            self._shortest[-1] = newest, min(shortest, mono_minus_source_s)
        else:
            self._shortest.append((second, mono_minus_source_s))
        while self._shortest[0][0] <= second - WINDOW_S:
            self._shortest.popleft()
        offset_s = min(each[1] for each in self._shortest)
        if self._known is not None and len(self._shortest) < AGREE_S:
            known_mono_s, known_s = self._known
            offset_s = min(offset_s, known_s + DRIFT * max(0.0, received_mono_s - known_mono_s))
        self._known = received_mono_s, offset_s
        return offset_s


class SessionClocks:
    """One clock for each session of Zenoh: what it publishes under whatever topics is of one machine."""

    def __init__(self, session_of: Callable[[str, bytes], str | None]) -> None:
        """``session_of`` tells it by topic and GID; None: it is not known, and the publisher has a clock of its own."""
        self._session_of = session_of
        self._sessions: dict[bytes, str] = {}
        self._clocks: dict[str, StampClock] = {}

    def of(self, topic: str, gid: bytes) -> StampClock:
        session = self._session_of(topic, gid) or self._sessions.get(gid)
        if session is not None:
            self._sessions[gid] = session
        own = gid.hex()
        name = own if session is None else session
        if name not in self._clocks:
            self._clocks[name] = self._clocks.pop(own, None) or StampClock()
        if len(self._sessions) > _MOST_PUBLISHERS:
            self._sessions.clear()
        if len(self._clocks) > _MOST_SESSIONS:
            del self._clocks[next(iter(self._clocks))]
        return self._clocks[name]
