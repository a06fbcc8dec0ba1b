"""The monotonic clocks of two stations compared through the router, so that the age of what the other tells is true.

Four stamps, as NTP takes them (RFC 5905, section 8): ours when our beacon left, theirs when it came, theirs when their
next beacon left, ours when that came. Their clock less ours lies within half the round trip of the middle, whichever of
the two ways was the slower one. Monotonic clocks, because those of the day are set while flights go on.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

KEPT = 32
"""Exchanges, about one in a second: the one with the smallest error counts."""
KEPT_S = 120.0
DRIFT = 2e-4
"""Two clocks may part by so much of the time that has gone: 100 ppm each."""
HELD_S = 30.0
"""A station that answers later has not looked at it for too long."""


@dataclass(frozen=True, slots=True)
class Compared:
    theirs_less_ours_s: float
    within_s: float
    """At the worse end: half the round trip, and the drift since."""
    round_trip_s: float


class Clocks:
    """Of one other station, and one run of its process."""

    def __init__(self) -> None:
        self._found: deque[tuple[float, Compared]] = deque(maxlen=KEPT)

    def on_exchange(self, *, left_s: float, came_there_s: float, left_there_s: float, came_s: float) -> bool:
        """False: no clocks run like that, and it is left out. Outer stamps are ours, inner ones theirs."""
        held_s = left_there_s - came_there_s
        round_trip_s = (came_s - left_s) - held_s
        drift_s = DRIFT * (came_s - left_s)
        if not (0.0 <= held_s <= HELD_S and round_trip_s >= -drift_s):
            return False
        middle_s = ((came_there_s - left_s) + (left_there_s - came_s)) / 2.0
        within_s = max(0.0, round_trip_s) / 2.0 + drift_s
        self._found.append((came_s, Compared(middle_s, within_s, max(0.0, round_trip_s))))
        return True

    def now(self, now_s: float) -> Compared | None:
        """The best of the last exchanges, its error as it has grown since; None: there is none."""
        best: Compared | None = None
        for came_s, found in self._found:
            gone_s = now_s - came_s
            if gone_s > KEPT_S:
                continue
            grown = Compared(found.theirs_less_ours_s, found.within_s + DRIFT * gone_s, found.round_trip_s)
            if best is None or grown.within_s < best.within_s:
                best = grown
        return best

    def forget(self) -> None:
        """One of the two has jumped: a computer that slept, for one."""
        self._found.clear()
