"""How often something may happen."""

from __future__ import annotations


class Bucket:
    """A token bucket on a clock that the caller reads: ``rate_per_s`` for ever, ``burst`` at once; may be overdrawn."""

    def __init__(self, rate_per_s: float, burst: float, now_s: float) -> None:
        self._rate_per_s, self._burst = rate_per_s, burst
        self._tokens, self._at_s = burst, now_s

    def left(self, now_s: float) -> float:
        self._tokens = min(self._burst, self._tokens + self._rate_per_s * max(0.0, now_s - self._at_s))
        self._at_s = now_s
        return self._tokens

    def spend(self, count: float) -> None:
        self._tokens -= count
