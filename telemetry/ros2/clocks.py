"""When a message was measured, on this machine's clocks, by its stamp and the time at which it was published.

A publisher's clock is known one way only: the shortest time that a message took bounds the offset from above. That
shortest way counts as none, so a frame is at most that much older than it is said to be.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

WINDOW_S = 30.0
"""Of messages by which the offset is judged."""
LARGE_OFFSET_S = 0.1
"""From which on it is said."""
MOST_BEHIND_S, MOST_AHEAD_S = 2.0, 0.05
"""A stamp this far from when its message was published is of another clock: a simulation's, or a device's own."""
_BACK_S = 0.1


@dataclass(frozen=True, slots=True)
class Measured:
    t_mono_s: float
    is_odd: bool
    """Its stamp tells another clock: it counts as measured when it was published."""


class StampClock:
    """One publisher's clock, laid over our monotonic one: a step of our own clock of day changes nothing."""

    def __init__(self) -> None:
        self._shortest: deque[tuple[float, float]] = deque()
        """(when received, monotonic time minus when published), the latter rising: the first is the smallest."""
        self._published_s, self._mono_minus_utc_s = -1.0, 0.0

    @property
    def offset_s(self) -> float:
        """Our clock of day minus the publisher's; 0 before the first message."""
        return self._shortest[0][1] - self._mono_minus_utc_s if self._shortest else 0.0

    def on_message(self, *, stamp_ns: int, source_ns: int, received_mono_s: float, received_utc_s: float) -> Measured:
        """``stamp_ns`` of its header, 0 for none; ``source_ns`` of its attachment."""
        source_s = source_ns / 1e9
        if source_s < self._published_s - _BACK_S:  # the publisher's clock was set back
            self._shortest.clear()
        self._published_s, self._mono_minus_utc_s = source_s, received_mono_s - received_utc_s
        self._take(received_mono_s, received_mono_s - source_s)
        behind_s = (source_ns - stamp_ns) / 1e9 if stamp_ns else 0.0
        is_odd = not -MOST_AHEAD_S <= behind_s <= MOST_BEHIND_S
        t_mono_s = source_s + self._shortest[0][1] - (0.0 if is_odd else behind_s)
        return Measured(min(received_mono_s, t_mono_s), is_odd)

    def _take(self, received_mono_s: float, mono_minus_source_s: float) -> None:
        while self._shortest and self._shortest[-1][1] >= mono_minus_source_s:
            self._shortest.pop()
        self._shortest.append((received_mono_s, mono_minus_source_s))
        while self._shortest[0][0] < received_mono_s - WINDOW_S:
            self._shortest.popleft()
