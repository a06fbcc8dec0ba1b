"""How good the link is: lost packets by their sequence numbers, and the round trip by TIMESYNC."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Message

WINDOW_S = 5.0
LARGEST_GAP = 100
"""A larger step of the 8-bit sequence number is a restart or a packet out of order, not a loss."""
ROUND_TRIP_LIMIT_S = 10.0
MOST_QUESTIONS = 12
"""That may still be answered."""


class SequenceQuality:
    """Share of one component's packets that arrived within the last seconds."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._events: deque[tuple[float, int]] = deque(maxlen=4096)

    def hear(self, sequence: int, now_s: float) -> None:
        step = 1 if self._last is None else (sequence - self._last) % 256
        if step == 0 or step > 256 - LARGEST_GAP:
            return  # the same packet again, or a late one
        self._last = sequence
        self._events.append((now_s, step - 1 if step <= LARGEST_GAP else 0))

    def share(self, now_s: float) -> float | None:
        """0 to 1; None when nothing came."""
        arrived = self._arrived(now_s)
        return arrived / (arrived + sum(lost for _, lost in self._events)) if arrived else None

    def hz(self, now_s: float) -> float:
        """Packets per second that arrived."""
        return self._arrived(now_s) / WINDOW_S

    def _arrived(self, now_s: float) -> int:
        while self._events and now_s - self._events[0][0] > WINDOW_S:
            self._events.popleft()
        return len(self._events)


@dataclass(frozen=True, slots=True)
class Reading:
    """One answer to a question that went out at ``asked_ns`` on our clock."""

    asked_ns: int
    round_trip_s: float
    ahead_s: float
    """The vehicle's clock before ours, if it was read in the middle: wrong by half the round trip at most."""


class RoundTripClock:
    """Asks with TIMESYNC and measures how long the answer takes, and what time it is on board."""

    def __init__(self) -> None:
        self.round_trip_s: float | None = None
        self._asked: dict[int, Reading | None] = {}

    def ask(self, now_s: float) -> Message:
        asked_ns = int(now_s * 1e9)
        self._asked[asked_ns] = None
        if len(self._asked) > MOST_QUESTIONS:
            del self._asked[next(iter(self._asked))]
        return mavlink.MAVLink_timesync_message(0, asked_ns)

    def reading(self, asked_ns: int) -> Reading | None:
        return self._asked.get(asked_ns)

    def on_message(self, message: Message, now_s: float) -> Reading | None:
        """The first answer to a question of ours."""
        if message.get_type() != "TIMESYNC" or message.tc1 == 0:
            return None
        asked_ns = message.ts1
        if asked_ns not in self._asked or self._asked[asked_ns] is not None:
            return None
        asked_s = asked_ns / 1e9
        taken_s = max(now_s - asked_s, 0.0)
        if taken_s >= ROUND_TRIP_LIMIT_S:
            return None
        self.round_trip_s = taken_s
        self._asked[asked_ns] = reading = Reading(asked_ns, taken_s, message.tc1 / 1e9 - asked_s - taken_s / 2)
        return reading


class RateMeter:
    """Events per second over the last seconds, as they really happened."""

    def __init__(self, window_s: float = 10.0) -> None:
        self._window_s = window_s
        self._times_s: deque[float] = deque(maxlen=1000)

    def count(self, now_s: float) -> None:
        self._times_s.append(now_s)

    def hz(self, now_s: float) -> float:
        while self._times_s and now_s - self._times_s[0] > self._window_s:
            self._times_s.popleft()
        if len(self._times_s) < 2:
            return 0.0
        # A beat that is overdue lowers the figure at once, not only when it comes.
        span_s = max(self._times_s[-1] - self._times_s[0], now_s - self._times_s[0] - 1.0)
        return (len(self._times_s) - 1) / span_s if span_s > 0 else 0.0
