"""How much may be sent: a steady rate, with a second of it saved up for bursts."""

from __future__ import annotations


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
