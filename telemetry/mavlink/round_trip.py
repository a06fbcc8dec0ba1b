"""How long to wait for an answer before asking again: learnt from the answers that came."""

from __future__ import annotations

FACTOR, MARGIN_S = 1.5, 0.03


class RoundTrip:
    """Exponential average; only messages that were sent once may be measured."""

    def __init__(self, *, unknown_s: float = 0.25, shortest_s: float = 0.1, longest_s: float = 1.0) -> None:
        self._unknown_s, self._shortest_s, self._longest_s = unknown_s, shortest_s, longest_s
        self._mean_s: float | None = None

    def measure(self, round_trip_s: float) -> None:
        before_s = round_trip_s if self._mean_s is None else self._mean_s
        self._mean_s = 0.8 * before_s + 0.2 * round_trip_s

    @property
    def patience_s(self) -> float:
        if self._mean_s is None:
            return self._unknown_s
        return min(max(FACTOR * self._mean_s + MARGIN_S, self._shortest_s), self._longest_s)
