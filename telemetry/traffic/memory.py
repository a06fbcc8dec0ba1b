"""Who was heard of: what is known of each aircraft, at most ``MOST`` of them, the nearest."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from telemetry.topics.traffic import GONE_S, TrafficSource
from telemetry.traffic.report import Identity, Position, Report

MOST = 200
MOST_CROWDED_OUT = 1_000
"""So many of those that are not kept are counted."""
_NAMELESS_S = 30.0
"""What told its name alone is kept for so long."""

Distance = Callable[[Position], float]
"""From the vehicle, in metres."""


@dataclass(slots=True)
class Heard:
    """One aircraft; ``position`` and ``at_s`` belong together."""

    key: str
    source: TrafficSource
    heard_s: float
    """Any message of it."""
    name: str = ""
    kind: str = ""
    is_crewed: bool = True
    operator_deg: tuple[float, float] | None = None
    says_own: bool = False
    """The vehicle itself tells of it."""
    position: Position | None = None
    at_s: float = 0.0
    """When it was there, on this machine's monotonic clock."""
    places: int = 0
    """Positions so far."""
    always_here: bool = True
    """Each of them was where the vehicle was, as fast as the vehicle."""

    def learn(self, identity: Identity) -> None:
        self.name, self.kind = identity.name or self.name, identity.kind or self.kind
        self.is_crewed = self.is_crewed if identity.is_crewed is None else identity.is_crewed
        self.operator_deg = identity.operator_deg or self.operator_deg

    def move(self, position: Position, now_s: float) -> bool:
        """Whether it says anything new: a position that is sent again is as old as it was."""
        before, at_s = self.position, now_s - position.delay_s
        if before is not None:
            is_again = position.stamp is not None and position.stamp == before.stamp
            if is_again and (position.lat_deg, position.lon_deg) == (before.lat_deg, before.lon_deg):
                return False
            if position.delay_s and at_s < self.at_s:
                return False
        self.position, self.at_s = position, at_s
        self.places += 1
        return True

    def is_gone(self, now_s: float) -> bool:
        if self.position is None:
            return now_s - self.heard_s > _NAMELESS_S
        return now_s - self.at_s > GONE_S


@dataclass(slots=True)
class TrafficMemory:
    aircraft: dict[str, Heard] = field(default_factory=dict[str, Heard])
    _refused: dict[str, float] = field(default_factory=dict[str, float])
    """Those that were not kept, and when they were last heard."""

    @property
    def crowded_out(self) -> int:
        return len(self._refused)

    def take(self, report: Report, distance: Distance, now_s: float) -> Heard | None:
        """What is known of it now; None where nearer ones leave no room for it."""
        known = self.aircraft.get(report.key)
        if known is None:
            known = Heard(report.key, report.source, now_s, is_crewed=report.source == "adsb")
            if not self._has_room(report.position, distance, now_s):
                self._refuse(report.key, now_s)
                return None
            self._refused.pop(report.key, None)
            self.aircraft[report.key] = known
        known.heard_s = now_s
        known.says_own = known.says_own or report.is_own
        known.learn(report.identity)
        return known

    def forget_gone(self, now_s: float) -> None:
        self.aircraft = {key: each for key, each in self.aircraft.items() if not each.is_gone(now_s)}
        self._refused = {key: at_s for key, at_s in self._refused.items() if now_s - at_s <= GONE_S}

    def _has_room(self, position: Position | None, distance: Distance, now_s: float) -> bool:
        """The farthest one goes, of those that are nowhere yet the one heard longest ago."""
        if len(self.aircraft) < MOST:
            return True

        def away(each: Heard) -> tuple[float, float]:
            return (math.inf if each.position is None else distance(each.position)), now_s - each.heard_s

        farthest = max(self.aircraft.values(), key=away)
        if away(farthest) <= (math.inf if position is None else distance(position), 0.0):
            return False
        del self.aircraft[farthest.key]
        self._refuse(farthest.key, now_s)
        return True

    def _refuse(self, key: str, now_s: float) -> None:
        self._refused.pop(key, None)
        self._refused[key] = now_s
        if len(self._refused) > MOST_CROWDED_OUT:
            del self._refused[next(iter(self._refused))]
