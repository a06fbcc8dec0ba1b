"""How good the link is: lost packets by their sequence numbers, and the round trip by TIMESYNC."""

from __future__ import annotations

from collections import deque

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Message

WINDOW_S = 5.0
LARGEST_GAP = 100
"""A larger step of the 8-bit sequence number is a restart or a packet out of order, not a loss."""
SYNC_EVERY_S = 2.0
ROUND_TRIP_LIMIT_S = 10.0


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
        while self._events and now_s - self._events[0][0] > WINDOW_S:
            self._events.popleft()
        arrived = len(self._events)
        return arrived / (arrived + sum(lost for _, lost in self._events)) if arrived else None


class RoundTripClock:
    """Asks with TIMESYNC and measures how long the answer takes."""

    def __init__(self) -> None:
        self.round_trip_s: float | None = None
        self._asked_s = -SYNC_EVERY_S
        self._asked_ns: int | None = None

    def on_tick(self, now_s: float) -> list[Message]:
        if now_s - self._asked_s < SYNC_EVERY_S:
            return []
        self._asked_s, self._asked_ns = now_s, int(now_s * 1e9)
        return [mavlink.MAVLink_timesync_message(0, self._asked_ns)]

    def on_message(self, message: Message, now_s: float) -> None:
        if message.get_type() != "TIMESYNC" or message.tc1 == 0 or message.ts1 != self._asked_ns:
            return
        self._asked_ns = None
        taken_s = now_s - self._asked_s
        if taken_s < ROUND_TRIP_LIMIT_S:
            self.round_trip_s = taken_s


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
