"""How far the flight is behind the plan's timing, counted from the first target."""

from __future__ import annotations

from telemetry.topics.messages import GuidedTarget


class Punctuality:
    def __init__(self) -> None:
        self.behind_s: float | None = None
        """Negative when ahead; None while nothing is known."""
        self._began: tuple[float, float] | None = None

    def reached(self, target: GuidedTarget, now_s: float) -> None:
        if self._began is None and target.t_s is not None:
            self._began = (now_s, target.t_s)
        self.behind_s = self._delay_s(target, now_s)

    def on_the_way(self, target: GuidedTarget, now_s: float) -> None:
        """Before it is reached a target can only be known to be late, not to be early."""
        delay_s = self._delay_s(target, now_s)
        if delay_s is not None and delay_s > (self.behind_s or 0.0):
            self.behind_s = delay_s

    def _delay_s(self, target: GuidedTarget, now_s: float) -> float | None:
        if self._began is None or target.t_s is None:
            return None
        began_s, planned_s = self._began
        return (now_s - began_s) - (target.t_s - planned_s)
