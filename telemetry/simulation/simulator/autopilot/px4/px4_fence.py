"""The simulated PX4's fence, as 1.17 does it: what is beyond, what is said, and which mode its failsafe takes.

Heights and the distance count from home. What its prediction (GF_PREDICT) does, and that it refuses missions which
leave the fence, is not simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.fence_shapes import FencePart, allowed
from telemetry.simulation.simulator.neu_frame import Vec3

CHECK_S = 0.2
WARN, HOLD, RETURN, TERMINATE, LAND = 1, 2, 3, 4, 5
"""GF_ACTION"""
LEAST_DELAY_S = 0.1
_MODES = {HOLD: "HOLD", RETURN: "RTL", LAND: "LAND"}
_SAID = {
    "distance": "Geofence: exceeding maximum distance to Home",
    "height": "Geofence: exceeding maximum altitude above Home",
    "shapes": "Geofence: approaching or outside geofence",
}
INVALID = "Geofence invalid, doesn't contain Home position"


@dataclass(frozen=True, slots=True)
class Px4FenceNews:
    texts: tuple[str, ...] = ()
    """Critical ones."""
    mode: str | None = None
    terminates: bool = False


NOTHING = Px4FenceNews()


class Px4Fence:
    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._parts: tuple[FencePart, ...] = ()
        self._beyond: frozenset[str] = frozenset()
        self._checked_s = -math.inf
        self._ordered, self._before = "", ""
        """The mode that its failsafe has taken, and the one before."""
        self._then: tuple[str, float] | None = None
        """A mode that it takes at a time."""

    @property
    def is_breached(self) -> bool:
        return bool(self._beyond)

    @property
    def acts(self) -> bool:
        """Its failsafe flies the vehicle."""
        return self._ordered != ""

    def take(self, parts: tuple[FencePart, ...], home_neu: Vec3) -> int:
        """How many parts are left out, for they forbid home."""
        self._parts = tuple(part for part in parts if part.allows(home_neu[:2]))
        return len(parts) - len(self._parts)

    def check(self, p_neu: Vec3, home_neu: Vec3, now_s: float, *, armed: bool, mode: str) -> Px4FenceNews:
        """``mode``: that is flown."""
        if self._ordered and (not armed or mode != self._ordered):  # somebody has taken over
            self._ordered, self._then = "", None
        if self._then is not None and now_s >= self._then[1]:
            return self._turn_to(self._then[0], mode, ("Failsafe activated",))
        if now_s - self._checked_s < CHECK_S:
            return NOTHING
        self._checked_s = now_s
        before, self._beyond = self._beyond, self._look(p_neu, home_neu)
        if not armed:
            return NOTHING
        said = tuple(text for kind, text in _SAID.items() if kind in self._beyond - before)
        if self._beyond and not before:
            return self._begin(mode, now_s, said)
        if before and not self._beyond and self._lands:
            back, self._ordered, self._then = self._before, "", None
            return Px4FenceNews(mode=back)
        return Px4FenceNews(said)

    @property
    def _lands(self) -> bool:
        """Of its actions, landing alone is over once the vehicle is within again."""
        return self.acts and int(self._parameters["GF_ACTION"]) == LAND

    def _begin(self, mode: str, now_s: float, said: tuple[str, ...]) -> Px4FenceNews:
        action, delay_s = int(self._parameters["GF_ACTION"]), self._parameters["COM_FAIL_ACT_T"]
        if action == TERMINATE:
            return Px4FenceNews((*said, "Failsafe activated"), terminates=True)
        if action not in _MODES or (action == RETURN and mode == "LAND"):
            return Px4FenceNews((*said, "Failsafe activated"))
        self._before = mode
        if action == HOLD or delay_s <= LEAST_DELAY_S:
            return self._turn_to(_MODES[action], mode, (*said, "Failsafe activated"))
        self._then = (_MODES[action], now_s + delay_s)
        text = f"Failsafe activated: entering Hold for {delay_s:.0f} seconds"
        self._ordered = "HOLD"
        return Px4FenceNews((*said, text), "HOLD")

    def _turn_to(self, ordered: str, mode: str, said: tuple[str, ...]) -> Px4FenceNews:
        self._ordered, self._then = ordered, None
        return Px4FenceNews(said, None if ordered == mode else ordered)

    def _look(self, p_neu: Vec3, home_neu: Vec3) -> frozenset[str]:
        p = self._parameters
        if p["GF_ACTION"] == 0:
            return frozenset()
        found = {
            "distance": 0 < p["GF_MAX_HOR_DIST"] <= math.dist(p_neu[:2], home_neu[:2]),
            "height": 0 < p["GF_MAX_VER_DIST"] <= p_neu[2] - home_neu[2],
            "shapes": not allowed(self._parts, p_neu[:2]),
        }
        return frozenset(kind for kind, is_beyond in found.items() if is_beyond)
