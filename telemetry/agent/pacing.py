"""The ground station's clock as the agent knows it, and how much may be sent."""

from __future__ import annotations

from collections import deque

EXCHANGES = 30


class Bandwidth:
    """Small messages always pass and count; a large one waits for its turn, which the sender may give up."""

    def __init__(self, bytes_per_s: float, *, now_s: float) -> None:
        self._rate = bytes_per_s
        self._saved = bytes_per_s
        self._at_s = now_s

    def spend(self, size: int, now_s: float) -> None:
        """Without asking: debts are paid by those who ask."""
        self._fill(now_s)
        self._saved -= size

    def takes(self, size: int, now_s: float) -> bool:
        """Whether ``size`` bytes may be sent now; they count as sent then."""
        self._fill(now_s)
        if self._saved < min(size, self._rate):
            return False
        self._saved -= size
        return True

    def _fill(self, now_s: float) -> None:
        self._saved = min(self._rate, self._saved + self._rate * max(0.0, now_s - self._at_s))
        self._at_s = now_s


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
