"""What is flown instead of the mission: stop, climb straight up until it is clear, go on in GUIDED, that much higher.

Bigazzi 2022, figs 9-10: velocity V1 until something is inside the region, then V2 (climb) until it is clear, then V1
again at the new altitude. Before the climb the vehicle is brought to a stand: it does not drift into what it saw.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from telemetry.flight.helm import GUIDED, Helm, here_of
from telemetry.flight.legs import Legs
from telemetry.flight.orders import CLIMB_SPEED, Place
from telemetry.flight.regions import OLD_S, Regions
from telemetry.flight.rest import Rest
from telemetry.mavlink.actions import Action
from telemetry.messages import GuidedTarget
from telemetry.obstacles import Sensor
from telemetry.vehicle import VehicleState

Phase = Literal["idle", "stopping", "taking", "climbing", "levelling", "going", "holding", "ceiling", "ending"]
AHEAD_M, AHEAD_AGAIN_M = 6.0, 4.0
"""The climb's target is never farther above the vehicle: without a link it climbs no farther than that."""
THERE_M = 0.3
LEVEL_M, LEVEL_M_S = 0.5, 0.3
HEARD_S = 2.0
"""A heartbeat as young as this shows the vehicle's mode."""
CLIMB_DECEL_M_S2 = 1.0
"""ArduCopter's WPNAV_ACCEL_Z."""


@dataclass(frozen=True, slots=True)
class DetourParams:
    climb_m_s: float = 1.5
    """V2"""
    ceiling_m: float = 30.0
    """Above the plan."""
    latency_s: float = 0.3
    """From seeing to braking."""


class Detour:
    """``look`` is called whenever anything is new; what it returns is to be sent at once."""

    def __init__(self, helm: Helm, regions: Regions, params: DetourParams) -> None:
        self._helm, self._regions, self._params = helm, regions, params
        self.forget()

    def forget(self) -> None:
        """Another flight, or somebody else flies."""
        self.phase: Phase = "idle"
        self.why = ""
        """It holds."""
        self.rest = Rest((), "hold")
        self.offset_m = 0.0
        self.engaged: frozenset[Sensor] = frozenset()
        self.is_manoeuvre = False
        self._paused = False
        self._then: Literal["climb", "go"] = "climb"
        self._over = True
        self._way: tuple[GuidedTarget, ...] = ()
        self._least_m = self._ceiling_m = self._wanted_offset_m = self._way_from_m = 0.0
        self._plan_m: float | None = None
        """Height of the plan where the vehicle stands."""
        self._column: Place | None = None
        self._legs: Legs | None = None

    @property
    def is_engaged(self) -> bool:
        return self.phase != "idle"

    @property
    def target(self) -> GuidedTarget | None:
        if self._legs is not None and not self.is_manoeuvre:
            return self._legs.target
        return self.rest.targets[0] if self.rest.targets else None

    # How it begins.

    def avoid(self, rest: Rest, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """Something is in the way of a flight of which ``rest`` is left, at its planned heights."""
        self.rest, self.engaged, self.is_manoeuvre, self._over, self._way = rest, seen_by, False, True, ()
        self._least_m, self._plan_m = 0.0, None
        return self._stop(now_s, then="climb")

    def avoid_again(self, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """On the rest of the flight, too."""
        return self.avoid(self.rest, seen_by, now_s)

    def fly(
        self, way: tuple[GuidedTarget, ...], rest: Rest, *, over: bool, offset_m: float, now_s: float
    ) -> list[Action]:
        """A prepared way, then the rest ``offset_m`` higher than planned. ``over``: climbs on while it is not clear."""
        self.rest, self.engaged, self.is_manoeuvre, self._over, self._way = rest, frozenset(), True, over, way
        self._least_m = self._way_from_m = way[0].alt_rel_home_m
        self._plan_m = None
        self._wanted_offset_m = max(offset_m, self.offset_m)
        return self._stop(now_s, then="climb")

    @property
    def goes_over(self) -> bool:
        """On a prepared way over something, whose top may not have been seen yet."""
        return self.phase == "going" and self.is_manoeuvre and self._over

    def climb_on(self, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """The prepared way was not high enough."""
        self.engaged, self._least_m = seen_by, 0.0
        return self._stop(now_s, then="climb")

    def pause(self, now_s: float) -> list[Action]:
        """The operator wants it to stay where it is."""
        then = "go" if self.phase == "going" else self._then
        actions = self._stop(now_s, then=then)
        self.phase, self._paused, self.why = "holding", True, "Paused."
        return actions

    def resume(self, state: VehicleState, now_s: float) -> list[Action]:
        if self.phase == "ceiling" and not self._regions.occupied(now_s):
            return self._level(state, now_s)
        if not self._paused:
            return []
        self._paused, self.why = False, ""
        self.phase = "stopping"
        return self.look(state, now_s)

    # What follows from what is seen.

    def look(self, state: VehicleState, now_s: float) -> list[Action]:
        steps = {
            "stopping": self._on_stopping,
            "taking": self._on_taking,
            "climbing": self._on_climbing,
            "levelling": self._on_levelling,
            "going": self._on_going,
            "holding": self._on_holding,
            "ending": self._on_ending,
        }
        step = steps.get(self.phase)
        return [] if step is None else step(state, now_s)

    def _stop(self, now_s: float, *, then: Literal["climb", "go"]) -> list[Action]:
        self.phase, self._then, self._paused = "stopping", then, False
        return self._helm.stop(now_s)

    def _on_stopping(self, state: VehicleState, now_s: float) -> list[Action]:
        if not self._helm.has_stopped(state, now_s):
            return self._stop_again_if_unheard(state, now_s)
        self.phase = "taking"
        return self._on_taking(state, now_s)

    def _stop_again_if_unheard(self, state: VehicleState, now_s: float) -> list[Action]:
        """An order to stop that was never answered is given again once the link is back and nobody has taken over."""
        heard_s = state.heartbeat_t_mono_s
        is_back = heard_s is not None and now_s - heard_s <= HEARD_S
        return self._helm.stop(now_s) if self._helm.failed and is_back else []

    def _on_taking(self, state: VehicleState, now_s: float) -> list[Action]:
        if state.mode != GUIDED:
            return self._helm.change_mode(GUIDED, now_s)
        if self._then == "go":
            self.phase = "going"
            return [] if self._legs is None else self._legs.go(state, now_s)
        return self._begin_climb(state, now_s)

    def _begin_climb(self, state: VehicleState, now_s: float) -> list[Action]:
        self._column = here = here_of(state)
        if self._plan_m is None:
            self._plan_m = here.alt_rel_home_m - self.offset_m
        highest_m = self._plan_m + self._params.ceiling_m if self._over else 0.0
        self._ceiling_m = max(highest_m, self._least_m, here.alt_rel_home_m)
        self.phase, self.why = "climbing", ""
        speed = self._helm.set_speed(self._params.climb_m_s, now_s, CLIMB_SPEED)
        return [*speed, *self._on_climbing(state, now_s)]

    def _on_climbing(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._column is not None
        self.engaged |= self._regions.seen_by(now_s)
        if why := self._old(state, now_s):
            return self._hold(why, state, now_s)
        height_m = state.alt_rel_home_m or 0.0
        if height_m >= self._least_m - THERE_M and self._is_clear(now_s):
            return self._level(state, now_s)
        if height_m >= self._ceiling_m - THERE_M:
            self.phase = "ceiling"
            return []
        aim = self._helm.place
        if aim is not None and aim.alt_rel_home_m - height_m >= min(AHEAD_AGAIN_M, self._ceiling_m - height_m):
            return []
        return self._rise_to(min(height_m + AHEAD_M, self._ceiling_m), now_s)

    def _is_clear(self, now_s: float) -> bool:
        return not self._over or self._regions.is_clear(self.engaged, now_s)

    def _rise_to(self, alt_rel_home_m: float, now_s: float) -> list[Action]:
        assert self._column is not None
        place = replace(self._column, alt_rel_home_m=alt_rel_home_m)
        return self._helm.go_to(place, now_s, radius_m=THERE_M, holds=True)

    def _level(self, state: VehicleState, now_s: float) -> list[Action]:
        """Ends the climb as soon as it can end without coming down again."""
        self.phase = "levelling"
        rising_m_s = max(0.0, state.climb_m_s or 0.0)
        room_m = rising_m_s * self._params.latency_s + rising_m_s**2 / (2 * CLIMB_DECEL_M_S2)
        height_m = max((state.alt_rel_home_m or 0.0) + room_m, self._least_m)
        return self._rise_to(min(height_m, self._ceiling_m), now_s)

    def _on_levelling(self, state: VehicleState, now_s: float) -> list[Action]:
        if why := self._old(state, now_s):
            return self._hold(why, state, now_s)
        if self._over and self._regions.occupied(now_s):
            self.phase = "climbing"
            return self._on_climbing(state, now_s)
        place = self._helm.place
        off_m = abs((state.alt_rel_home_m or 0.0) - (place.alt_rel_home_m if place else 0.0))
        if off_m > LEVEL_M or abs(state.climb_m_s or 0.0) > LEVEL_M_S:
            return []
        return self._go_on(state, now_s)

    def _go_on(self, state: VehicleState, now_s: float) -> list[Action]:
        """At the new height."""
        place = self._helm.place
        assert place is not None
        assert self._plan_m is not None
        climbed_m = place.alt_rel_home_m - self._plan_m
        self.phase = "going"
        if self.is_manoeuvre:
            extra_m = max(0.0, place.alt_rel_home_m - self._way_from_m)
            self.offset_m = max(self._wanted_offset_m, climbed_m if self._over else 0.0)
            self._legs = Legs(self._helm, _raised(self._way, extra_m))
        else:
            self.offset_m = max(self.offset_m, climbed_m)
            self._legs = Legs(self._helm, self.rest.raised(self.offset_m).targets)
        return self._legs.go(state, now_s) or self._on_going(state, now_s)

    def _on_going(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._legs is not None
        actions = self._legs.on_look(state, now_s)
        if not self._legs.is_over:
            self._drop_flown()
            return actions
        if self.is_manoeuvre:
            self.is_manoeuvre = False
            self._legs = Legs(self._helm, self.rest.raised(self.offset_m).targets)
            if self.rest.targets:
                return [*actions, *self._legs.go(state, now_s)]
        return [*actions, *self._end(now_s)]

    def _drop_flown(self) -> None:
        """Way and rest are what is still to be flown, at their planned heights."""
        assert self._legs is not None
        if self.is_manoeuvre:
            self._way = self._way[-len(self._legs.left) :]
        else:
            self.rest = replace(self.rest, targets=self.rest.targets[-len(self._legs.left) :])

    def _end(self, now_s: float) -> list[Action]:
        if self.rest.end == "hold":
            self.phase, self.why, self._paused = "holding", "The way is flown: it holds.", True
            return []
        self.rest, self.offset_m, self.phase = replace(self.rest, targets=()), 0.0, "ending"
        return self._helm.change_mode(self.rest.end.upper(), now_s)

    def _on_ending(self, state: VehicleState, now_s: float) -> list[Action]:
        if state.mode == self.rest.end.upper():
            self._helm.let_go()
            self.phase = "idle"
        return []

    # What makes it stay where it is.

    def _old(self, state: VehicleState, now_s: float) -> str:
        """Why nothing can be told about what is ahead now; empty while all is well."""
        at_s = state.position_t_mono_s
        if at_s is None or now_s - at_s > OLD_S:
            return "The vehicle's position is too old."
        sight = self._regions.oldest(self.engaged, now_s)
        return "" if sight is None else f"Nothing new from {sight.sensor}."

    def _hold(self, why: str, state: VehicleState, now_s: float) -> list[Action]:
        self.phase, self.why, self._then = "holding", why, "climb"
        return self._helm.stop(now_s)

    def _on_holding(self, state: VehicleState, now_s: float) -> list[Action]:
        if not self._helm.has_stopped(state, now_s):
            return self._stop_again_if_unheard(state, now_s)
        if self._paused or self._old(state, now_s):
            return []
        self.phase = "taking"
        return self._on_taking(state, now_s)


def _raised(targets: tuple[GuidedTarget, ...], by_m: float) -> tuple[GuidedTarget, ...]:
    return tuple(replace(t, alt_rel_home_m=t.alt_rel_home_m + by_m) for t in targets)
