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
MOST_QUESTIONS = 20
"""That may still be answered."""
COUNTED = 8
"""Answers are counted against so many questions."""
DUE_S, DUE_LIMIT_S = 1.0, 5.0
"""A question counts as unanswered after twice the last round trip, within these."""


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
class ClockReading:
    """One answer to a question that went out at ``asked_ns`` on our clock."""

    asked_ns: int
    round_trip_s: float
    ahead_s: float
    """The vehicle's clock before ours, if it was read in the middle: wrong by half the round trip at most."""


class RoundTripClock:
    """Asks with TIMESYNC and measures how long the answer takes, and what time it is on board.

    Behind a router on board the answer comes over every way: ``number``, of this way alone, stands in its questions as
    nanoseconds, and tells its own answers from the others'.
    """

    def __init__(self, number: int = 0) -> None:
        self._number = number
        self.round_trip_s: float | None = None
        self.answered_s = float("-inf")
        """When the last answer came."""
        self._answered_ns = 0
        self._asked: dict[int, ClockReading | None] = {}

    def ask(self, now_s: float) -> Message:
        asked_ns = int(now_s * 1e9)
        self._asked[asked_ns] = None
        if len(self._asked) > MOST_QUESTIONS:
            del self._asked[next(iter(self._asked))]
        return mavlink.MAVLink_timesync_message(0, asked_ns + self._number)

    def reading(self, asked_ns: int) -> ClockReading | None:
        return self._asked.get(asked_ns)

    def share(self, now_s: float) -> float | None:
        """Of the last questions that were answered; None while that cannot be told."""
        outcomes = self._outcomes(now_s)[-COUNTED:]
        return sum(outcomes) / len(outcomes) if outcomes else None

    def unanswered(self, now_s: float) -> int:
        """So many in a row, up to now."""
        outcomes = self._outcomes(now_s)
        return len(outcomes) if True not in outcomes else outcomes[::-1].index(True)

    def answered_beyond(self, other: RoundTripClock) -> int:
        """Answers to questions that were asked after the last one that the other one has an answer to."""
        return sum(each is not None and each.asked_ns > other._answered_ns for each in self._asked.values())

    def forget_unanswered(self, now_s: float) -> None:
        """Nothing could be heard: what did not come says nothing of what went out."""
        due_s = self._due_s(now_s)
        self._asked = {at: each for at, each in self._asked.items() if each is not None or at / 1e9 >= due_s}

    def _outcomes(self, now_s: float) -> list[bool]:
        """Whether each question was answered, the oldest first, without those that well may be yet."""
        due_s = self._due_s(now_s)
        return [each is not None for at, each in self._asked.items() if each is not None or at / 1e9 < due_s]

    def _due_s(self, now_s: float) -> float:
        """What was asked before this may count as unanswered."""
        return now_s - min(max(DUE_S, 2 * (self.round_trip_s or 0.0)), DUE_LIMIT_S)

    def on_message(self, message: Message, now_s: float) -> ClockReading | None:
        """The first answer to a question of ours."""
        if message.get_type() != "TIMESYNC" or message.tc1 == 0:
            return None
        asked_ns = message.ts1 - self._number
        if asked_ns not in self._asked or self._asked[asked_ns] is not None:
            return None
        asked_s = asked_ns / 1e9
        taken_s = max(now_s - asked_s, 0.0)
        if taken_s >= ROUND_TRIP_LIMIT_S:
            return None
        self.round_trip_s, self.answered_s = taken_s, now_s
        self._answered_ns = max(asked_ns, self._answered_ns)
        self._asked[asked_ns] = reading = ClockReading(asked_ns, taken_s, message.tc1 / 1e9 - asked_s - taken_s / 2)
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
