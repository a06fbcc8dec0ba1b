"""What the navigation script watches while it flies: the mode, the plan's timing, and that the vehicle comes nearer."""

from __future__ import annotations

import math

from mapping.geometry.frames import apart_m
from telemetry.flight.guided.handover import away_m
from telemetry.flight.guided.orders import Place
from telemetry.flight.home_watch import HomePlace, follows_m, home_of, is_within, spare_up_m
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.vehicle import VehicleState

PATIENCE_S = 10.0
NEARER_M = 0.5
"""Less may be the vehicle's swaying."""
LEVEL_M = 0.5


class ModeWatch:
    """Whether the vehicle is still armed and in a flight mode that the script has asked for."""

    def __init__(self) -> None:
        self.seen = False
        """Whether the mode that was asked for last has shown."""
        self._asked: frozenset[str] = frozenset()
        self._before: frozenset[str] = frozenset()
        self._was_armed = False

    def expect(self, modes: frozenset[str], *, before: frozenset[str]) -> None:
        """From now on any of ``modes``; until one of them shows, those of ``before`` too."""
        self._asked, self._before, self.seen = modes, before, False

    def interruption(self, state: VehicleState) -> str:
        """Why the script must end; empty while all is well."""
        self._was_armed |= state.armed
        if self._was_armed and not state.armed:
            return "The vehicle has disarmed."
        if state.mode in self._asked:
            self.seen = True
            return ""
        if not self.seen and state.mode in self._before:
            return ""
        if state.critical:
            return f"The vehicle has changed to {state.mode} by itself: a failsafe is active."
        return f"The flight mode was changed to {state.mode}: the pilot took over."


class HomeWatched:
    """Home as it was when the script had taken off, or set out: its places count from there, and go with it."""

    def __init__(self, spare_m: float | None = None, certified: HomePlace | None = None) -> None:
        """``spare_m``: what the way keeps beyond the clearance that is required; ``certified``: home as it was judged
        for; None: not known."""
        self._home = certified
        self._spare_m = spare_up_m(spare_m)

    def interruption(self, state: VehicleState) -> str:
        """Why the script must end: its places would be elsewhere, or as much higher or lower. Empty: they are not."""
        home = home_of(state)
        self._home = before = self._home or home
        if home is None or before is None:
            return ""
        if is_within(home, before, min(follows_m(state), self._spare_m)):
            return ""
        away_m = apart_m((before.lat_deg, before.lon_deg), (home.lat_deg, home.lon_deg))
        rose_m = home.alt_amsl_m - before.alt_amsl_m
        far = f"{math.hypot(away_m, rose_m):.1f} m"
        return f"Home was moved by {far}: what is flown was certified for the home before. The vehicle holds."


class Punctuality:
    """How far the flight is behind the plan's timing, counted from the first target."""

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


class Standstill:
    """A vehicle that was sent to one place after the other and comes no nearer: since when, and why that may be."""

    def __init__(self) -> None:
        self._place: Place | None = None
        self._nearest_m, self._since_s = 0.0, 0.0

    def words(self, state: VehicleState, place: Place, name: str, now_s: float) -> str:
        """What is to be said; empty while it comes nearer. ``name``: of the place."""
        left_m = away_m(state, place)
        if self._place != place or left_m < self._nearest_m - NEARER_M:
            self._place, self._nearest_m, self._since_s = place, left_m, now_s
        seconds = now_s - self._since_s
        if seconds < PATIENCE_S:
            return ""
        return f"The vehicle has come no nearer to {name} for {seconds:.0f} s. {_why(state, place)}"


def _why(state: VehicleState, place: Place) -> str:
    if state.alt_rel_home_m is None:
        return "Its height is not known."
    up_m = place.alt_rel_home_m - state.alt_rel_home_m
    if state.landed == "on_ground":
        below = " The way leads below its home, and it does not know what lies there." if up_m < -LEVEL_M else ""
        return f"It stands on the ground.{below} Take it over by remote control, or command the return."
    if abs(up_m) > LEVEL_M:
        side = "below" if up_m > 0 else "above"
        return f"It hovers {abs(up_m):.1f} m {side} it: something keeps it from going there, or its home has moved."
    return "Strong wind, a fence, or its own avoidance may hold it. Command the return if it does not go on."
