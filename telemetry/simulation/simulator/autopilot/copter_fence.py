"""The simulated ArduCopter's fence, as AC_Fence of 4.6 and 4.7 does it: what is beyond, what is said, what is done.

Which kinds act it takes from FENCE_TYPE when it is switched on; those that are taken from FENCE_TYPE later act no more.
It acts on where the vehicle is, at the limit itself: its margin counts for the return height, for the floor and when
it arms. Stopping before a fence (AVOID_ENABLE) is not simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.fence_shapes import FencePart, allowed
from telemetry.simulation.simulator.neu_frame import Vec3

CEILING, CIRCLE, SHAPES, FLOOR = 1, 2, 4, 8
"""Of FENCE_TYPE."""
CHECK_S = 0.04
GIVE_UP_M = 100.0
"""So far beyond height or circle it lands."""
BACKUP_M = 20.0
"""Beyond it by so much more it acts anew."""
_NAMES = {CEILING: "Max Alt", CIRCLE: "Circle", SHAPES: "Polygon", FLOOR: "Min Alt"}
_MODES = {1: ("RTL",), 2: (), 3: ("SMART_RTL", "RTL"), 4: ("BRAKE",), 5: ("SMART_RTL",)}
"""By FENCE_ACTION; LAND where none of them can be had."""


@dataclass(frozen=True, slots=True)
class FenceNews:
    texts: tuple[str, ...] = ()
    modes: tuple[str, ...] = ()
    """To be tried one after the other; none: nothing is done."""


NOTHING = FenceNews()


class CopterFence:
    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self.parts: tuple[FencePart, ...] = ()
        self.breached = self.count = 0
        self.breached_s = 0.0
        self._floor_on = False
        self._was_on, self._taken = self.is_on, self._kinds_told() if self.is_on else 0
        self._checked_s = -math.inf
        self._beyond_m: dict[int, float] = {}
        self._backup_m: dict[int, float] = {}

    @property
    def is_on(self) -> bool:
        return self._parameters["FENCE_ENABLE"] > 0

    @property
    def acts(self) -> bool:
        """SYS_STATUS calls it enabled."""
        return self.is_on and self._parameters["FENCE_ACTION"] > 0

    @property
    def highest_return_m(self) -> float:
        """Above home."""
        p = self._parameters
        return p["FENCE_ALT_MAX"] - p["FENCE_MARGIN"] if self._kinds() & CEILING else math.inf

    def allows(self, place_neu: Vec3, home_neu: Vec3) -> bool:
        """As a place to be sent to in GUIDED."""
        return not any(beyond_m > 0 for beyond_m in self._beyond(place_neu, home_neu).values())

    def why_not_arm(self) -> str | None:
        p = self._parameters
        if not self.is_on or not int(p["FENCE_TYPE"]):
            return None
        if self.breached:
            return f"Vehicle breaching {self._named(self.breached)}"
        if p["FENCE_ALT_MAX"] < p["FENCE_ALT_MIN"]:
            return "FENCE_ALT_MAX < FENCE_ALT_MIN"
        too_big = p["FENCE_ALT_MAX"] - p["FENCE_ALT_MIN"] <= 2 * p["FENCE_MARGIN"]
        return "FENCE_MARGIN too big" if too_big else None

    def check(self, p_neu: Vec3, home_neu: Vec3, now_s: float, *, flying: bool, landing: bool) -> FenceNews:
        """25 times a second. ``landing``: or on the ground, where the floor does not count."""
        if now_s - self._checked_s < CHECK_S:
            return NOTHING
        self._checked_s = now_s
        if self.is_on != self._was_on:
            self._was_on, self._taken = self.is_on, self._kinds_told() if self.is_on else 0
        texts = self._switch_floor(p_neu[2] - home_neu[2], landing=landing)
        was = self.breached
        new = self._look(p_neu, home_neu, now_s)
        if new:
            if flying:
                texts.append(f"{self._named(new)} breached")
            return FenceNews(tuple(texts), self._action(new))
        if was and not self.breached and flying:
            texts.append("Fence breach cleared")
        return FenceNews(tuple(texts))

    def _kinds(self) -> int:
        """That act now."""
        if not self.is_on:
            return 0
        kinds = self._kinds_told() & (self._taken | FLOOR)
        kinds &= ~(0 if self.parts else SHAPES)
        return kinds if self._floor_on else kinds & ~FLOOR

    def _kinds_told(self) -> int:
        return int(self._parameters["FENCE_TYPE"])

    def _switch_floor(self, alt_m: float, *, landing: bool) -> list[str]:
        """It comes on once the vehicle is above it by the margin, and is off while it lands."""
        p = self._parameters
        configured = self.is_on and bool(int(p["FENCE_TYPE"]) & FLOOR)
        if self._floor_on and (landing or not configured):
            self._floor_on = False
            return [f"{self._named(FLOOR)} auto-disabled"] if configured else []
        if configured and not landing and not self._floor_on and alt_m >= p["FENCE_ALT_MIN"] + p["FENCE_MARGIN"]:
            self._floor_on = True
            return [f"{self._named(FLOOR)} enabled (auto enable)"]
        return []

    def _beyond(self, p_neu: Vec3, home_neu: Vec3) -> dict[int, float]:
        """How far it is beyond each part that acts; shapes do not tell how far."""
        p, kinds = self._parameters, self._kinds()
        alt_m, away_m = p_neu[2] - home_neu[2], math.dist(p_neu[:2], home_neu[:2])
        found = {
            CEILING: alt_m - p["FENCE_ALT_MAX"],
            CIRCLE: away_m - p["FENCE_RADIUS"],
            FLOOR: p["FENCE_ALT_MIN"] - alt_m,
            SHAPES: -1.0 if allowed(self.parts, p_neu[:2]) else 0.001,
        }
        return {kind: beyond_m for kind, beyond_m in found.items() if kinds & kind}

    def _look(self, p_neu: Vec3, home_neu: Vec3, now_s: float) -> int:
        new, was = 0, self.breached
        self._beyond_m = self._beyond(p_neu, home_neu)
        for kind in _NAMES:
            beyond_m = self._beyond_m.get(kind, -1.0)
            if beyond_m < 0:
                self.breached &= ~kind
                continue
            if not self.breached & kind or (kind != SHAPES and beyond_m >= self._backup_m[kind]):
                new |= kind
                self._backup_m[kind] = beyond_m + BACKUP_M
                self.breached |= kind
                self.count += 1
        if new and not was:
            self.breached_s = now_s
        return new

    def _action(self, new: int) -> tuple[str, ...]:
        action = int(self._parameters["FENCE_ACTION"])
        if action == 0:
            return ()
        farthest_m = max((m for kind, m in self._beyond_m.items() if kind & new and kind != SHAPES), default=0.0)
        return ("LAND",) if farthest_m > GIVE_UP_M else (*_MODES.get(action, ("RTL",)), "LAND")

    @staticmethod
    def _named(kinds: int) -> str:
        *others, last = [name for kind, name in sorted(_NAMES.items()) if kinds & kind]
        names = f"{', '.join(others)} and {last}" if others else last
        return f"{names} fence{'s' if others else ''}"
