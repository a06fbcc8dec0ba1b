"""The ground station's clock as the agent knows it: from the quickest of the last exchanges."""

from __future__ import annotations

from collections import deque

EXCHANGES = 30


class RemoteClock:
    """An exchange that took r seconds tells the other clock to within r / 2."""

    def __init__(self) -> None:
        self._exchanges: deque[tuple[float, float]] = deque(maxlen=EXCHANGES)

    @property
    def is_known(self) -> bool:
        return bool(self._exchanges)

    @property
    def round_trip_s(self) -> float:
        """Of the quickest exchange; inf before the first."""
        return min(self._exchanges)[0] if self._exchanges else float("inf")

    def on_answer(self, *, asked_s: float, remote_s: float, now_s: float) -> None:
        if now_s >= asked_s:
            self._exchanges.append((now_s - asked_s, remote_s - (asked_s + now_s) / 2.0))

    def remote_s(self, own_s: float) -> float:
        """A moment of the own clock on the other one. Only once it ``is_known``."""
        return own_s + min(self._exchanges)[1]
