"""At most so many messages a second, the first ones at once: what pages can draw, without a wait to be seen."""

from __future__ import annotations


class Pace:
    """A token bucket on a clock that the caller reads."""

    def __init__(self, rate_hz: float, *, burst: float) -> None:
        self._rate_hz, self._burst = rate_hz, burst
        self._tokens, self._at_mono_s = burst, 0.0

    def wait_s(self, now_mono_s: float) -> float:
        """Until the next message may go; 0: it goes now, and counts."""
        self._tokens = min(self._burst, self._tokens + self._rate_hz * max(0.0, now_mono_s - self._at_mono_s))
        self._at_mono_s = now_mono_s
        if self._tokens >= 1.0:
            self._tokens -= 1.0
            return 0.0
        return (1.0 - self._tokens) / self._rate_hz
