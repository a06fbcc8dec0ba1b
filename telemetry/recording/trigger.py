"""When to record, and what a recording begins with: from arming until a little after disarming, or by the operator."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from telemetry.recording.recorded_topics import LATEST
from telemetry.topics.messages import Published
from telemetry.topics.vehicle import VehicleState

AFTER_DISARM_S = 7.0
"""Landing and what the vehicle says about it belong to the flight."""
GONE_S = 600.0
"""A vehicle that was not heard for so long does not come back from this flight."""
SECONDS = 5.0
_MOST = 20_000


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

    @property
    def by_hand(self) -> bool:
        return self._by_hand

    def start_by_hand(self) -> None:
        """Goes on after the landing until it is stopped by hand."""
        self.wanted, self._by_hand, self._refused = True, True, False

    def go_on(self, now_s: float, *, by_hand: bool) -> None:
        """With the recording of a killed recorder; if not by hand, until the vehicle turns out to be disarmed."""
        self.wanted, self._by_hand, self._armed, self._heard_s = True, by_hand, True, now_s

    def stop_by_hand(self) -> None:
        """In flight: not again before the next arming."""
        self.wanted, self._by_hand, self._disarmed_s = False, False, None
        self._refused = self._armed


class Stamped(NamedTuple):
    t_mono_s: float
    topic: str
    message: Published


class Preroll:
    """Bounded in time and number: the oldest go first."""

    def __init__(self) -> None:
        self._recent: deque[Stamped] = deque(maxlen=_MOST)
        self._latest: dict[str, Stamped] = {}

    def add(self, stamped: Stamped) -> None:
        self._recent.append(stamped)
        if stamped.topic in LATEST:
            self._latest[stamped.topic] = stamped
        while self._recent[0].t_mono_s < stamped.t_mono_s - SECONDS:
            self._recent.popleft()

    def take(self, now_s: float) -> list[Stamped]:
        """The latest of each state that did not change lately, then all of the last seconds, in order."""
        recent = [stamped for stamped in self._recent if stamped.t_mono_s >= now_s - SECONDS]
        start_s = recent[0].t_mono_s if recent else now_s
        told = {stamped.topic for stamped in recent}
        older = [Stamped(start_s, topic, s.message) for topic, s in self._latest.items() if topic not in told]
        return older + recent
