"""When to record: from arming until a little after disarming, or from the operator's word to the operator's word."""

from __future__ import annotations

from telemetry.topics.vehicle import VehicleState

AFTER_DISARM_S = 7.0
"""Landing and what the vehicle says about it belong to the flight."""
GONE_S = 600.0
"""A vehicle that was not heard for so long does not come back from this flight."""


class Trigger:
    """Says whether a recording is wanted; the operator's word counts until the next flight."""

    def __init__(self) -> None:
        self.wanted = False
        self._by_hand = False
        self._refused = False
        self._armed = False
        self._disarmed_s: float | None = None
        self._heard_s = 0.0

    def on_state(self, state: VehicleState, now_s: float) -> None:
        self._heard_s = now_s
        if state.armed and not self._refused:
            self.wanted, self._disarmed_s = True, None
        elif not state.armed:
            self._refused = False
            if self._armed:
                self._disarmed_s = now_s
        self._armed = state.armed

    def on_tick(self, now_s: float) -> None:
        if self._by_hand or not self.wanted:
            return
        landed = self._disarmed_s is not None and now_s - self._disarmed_s >= AFTER_DISARM_S
        if landed or now_s - self._heard_s >= GONE_S:
            self.wanted, self._disarmed_s = False, None

    def start_by_hand(self) -> None:
        """Goes on after the landing until it is stopped by hand."""
        self.wanted, self._by_hand, self._refused = True, True, False

    def stop_by_hand(self) -> None:
        """In flight: not again before the next arming."""
        self.wanted, self._by_hand, self._disarmed_s = False, False, None
        self._refused = self._armed
