"""A flight that is faster than its sensors see far enough to stop for is slowed."""

from __future__ import annotations

import math

from telemetry.flight.avoidance.regions import FASTER_M_S, largest_speed
from telemetry.flight.guided.helm import Helm
from telemetry.mavlink.actions import Action
from telemetry.topics.vehicle import VehicleState

AGAIN_S = 2.0
"""A vehicle that is still too fast, or again because its mission says so, is told once more."""


class Slowing:
    """Of a flight that is faster than its sensors see far enough to stop for.

    ``look`` is called whenever anything is new. A flight that was slowed stays so, whatever is seen later.
    """

    def __init__(self, helm: Helm) -> None:
        self._helm = helm
        self.asked_m_s: float | None = None
        self.as_late = False
        """It was slowed while frames came late."""
        self._asked_s = -math.inf
        self._mode = ""

    def on_state(self, state: VehicleState) -> None:
        """Another mode has speeds of its own."""
        if state.mode != self._mode:
            self.forget()
        self._mode = state.mode

    def forget(self) -> None:
        """What is flown next is flown at speeds of its own."""
        self.asked_m_s, self._asked_s, self.as_late = None, -math.inf, False

    def look(self, state: VehicleState, largest_m_s: float, now_s: float, *, is_late: bool) -> list[Action]:
        """In a mode that is flown by no pilot."""
        speed_m_s = state.ground_speed_m_s or 0.0
        wanted_m_s = largest_speed(largest_m_s)
        if speed_m_s <= wanted_m_s + FASTER_M_S or now_s - self._asked_s < AGAIN_S:
            return []
        actions = self._helm.slow_down(wanted_m_s, now_s)
        if actions:
            self.asked_m_s, self._asked_s, self.as_late = wanted_m_s, now_s, is_late
        return actions
