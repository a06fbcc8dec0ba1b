"""Flies what ``phases.py`` draws: looks for the events of its phase, and does what each of them asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from telemetry.flight.avoidance.backing import Backing
from telemetry.flight.avoidance.climb import Climb
from telemetry.flight.avoidance.detour_state import DetourState
from telemetry.flight.avoidance.phases import (
    TABLE,
    Along,
    Avoid,
    Event,
    Over,
    Past,
    Phase,
    Sidestep,
    Variant,
    Way,
    next_phase,
    raised,
)
from telemetry.flight.guided.legs import Legs
from telemetry.flight.guided.remaining_mission import RemainingMission
from telemetry.mavlink.actions import Action
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import Sensor
from telemetry.topics.vehicle import VehicleState


class Detour(DetourState):
    """``look`` is called whenever anything is new; what it returns is to be sent at once.

    An order that the present phase does not know changes nothing.
    """

    # Orders: of the operator, and of who watches.

    def avoid(self, remaining: RemainingMission, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """Something is in the way of a flight of which this is left, at its planned heights."""
        self._set_out(Avoid(), remaining, seen_by)
        self._regions.rely()
        self._plan_m = None
        return self._brake("obstacle", now_s, then="climb")

    def avoid_again(self, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """On the rest of the flight, too."""
        return self.avoid(self.remaining, seen_by, now_s)

    def climb_on(self, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """The prepared way was not high enough."""
        self._set_out(replace(self.variant, least_m=0.0), self.remaining, seen_by)
        return self._brake("obstacle", now_s, then="climb")

    def fly(
        self,
        places: tuple[GuidedTarget, ...],
        remaining: RemainingMission,
        *,
        over: bool,
        offset_m: float,
        now_s: float,
    ) -> list[Action]:
        """A prepared way, then the rest ``offset_m`` higher than planned."""
        kind, from_m = Over if over else Past, places[0].alt_rel_home_m
        seen_by, eyes = self._regions.seen_by(now_s), self._regions.eyes(now_s)
        lookouts = seen_by or frozenset(self._regions.counted(now_s)) or frozenset(eye.sensor for eye in eyes)
        self._set_out(kind(places, max(offset_m, self.offset_m), lookouts, from_m, from_m), remaining, frozenset())
        self._plan_m = None
        return self._brake("way ordered", now_s, then="climb")

    def sidestep(self, places: tuple[GuidedTarget, ...], remaining: RemainingMission, *, now_s: float) -> list[Action]:
        """At once: who brakes first stays where the moving object is expected. The rest is as high as it was."""
        self._set_out(Sidestep(places, self.offset_m), remaining, frozenset())
        self._plan_m, self._legs = None, Legs(self._helm, places)
        self._then, self._paused = "go", False
        self._enter("sidestep ordered")
        return self._helm.change_mode(self._helm.guided_mode, now_s)

    def step_aside(self, state: VehicleState, remaining: RemainingMission, now_s: float) -> list[Action]:
        """Past what the tracks say, along the rest of the flight and back onto its line."""
        if not self._enter("step aside"):
            return []
        self._set_out(Along(), remaining, frozenset())
        targets = remaining.raised(self.offset_m).targets
        self._then, self._legs = "go", Legs(self._helm, targets)
        self.aside.begin(state, targets)
        return self.look(state, now_s)

    def give_up_aside(self, state: VehicleState, now_s: float) -> list[Action]:
        """On towards what it cannot pass, slowly enough to stop, until a region shows it: then it is climbed over."""
        if not self._enter("no way past"):
            return []
        self.aside.give_up(now_s)
        return [*self._helm.change_mode(self._helm.guided_mode, now_s), *self._hand_over(state, now_s)]

    def come_down(self, targets: tuple[GuidedTarget, ...], state: VehicleState, now_s: float) -> list[Action]:
        """The rest at heights of its own, which are certified past what was seen."""
        if not self._enter("lower line"):
            return []
        self.remaining, self.offset_m, self.came_down = replace(self.remaining, targets=targets), 0.0, True
        self._legs = Legs(self._helm, targets)
        return self._legs.go(state, now_s)

    def stop_short(self, now_s: float) -> list[Action]:
        """The prepared way is not clear: it holds, and whoever ordered it decides."""
        return self._stay("blocked", "Something stands on the way past: it holds. Fly another way, or return.", now_s)

    def stop_at_fence(self, why: str, now_s: float) -> list[Action]:
        """It goes nowhere from here by itself."""
        return self._stay("beyond fence", f"{why} It holds: return home, or take over.", now_s)

    def stop_aside(self, now_s: float) -> list[Action]:
        """Nobody wants it to step aside any more: beside its line it holds, and goes back there at an order only."""
        why = "Stepping aside was switched off: it holds. Resume goes on along its line."
        return self._stay("switched off", why, now_s)

    def hold_if_silent(self, state: VehicleState, now_s: float) -> list[Action]:
        """On the way past and on the rest of the flight: not without the frames of those who saw what stands there."""
        why = self._trusted.silent(state, now_s)
        return self._brake("silent", now_s, then="go", why=why) if why else []

    def pause(self, now_s: float) -> list[Action]:
        """The operator wants it to stay where it is."""
        return self._stay("paused", "Paused.", now_s, then="go" if self.phase == "going" else self._then)

    def resume(self, state: VehicleState, now_s: float) -> list[Action]:
        if self.phase == "ceiling" and self._trusted.say_clear(now_s):
            self._enter("clear at last")
            return self._level(state, now_s)
        if self.phase == "aside" and self.aside.why:
            return self.give_up_aside(state, now_s)
        if not self._paused:
            if self.phase == "holding":
                self.count_on_nobody()
            return []
        self._paused, self.why = False, ""
        self._enter("resumed")
        return self.look(state, now_s)

    def count_on_nobody(self) -> None:
        """The rest of the flight is gone on with, whether anybody looks ahead or not."""
        if isinstance(self.variant, Way):
            self.variant = replace(self.variant, lookouts=frozenset())
        if self.phase == "going" or self._then == "go":
            self._trusted.sensors = frozenset()

    # How one phase follows another, and how the vehicle brakes.

    def look(self, state: VehicleState, now_s: float) -> list[Action]:
        """The first event of this phase that holds now is done."""
        self._renew_why(state, now_s)
        before = _ALWAYS[self.phase](self, state, now_s) if self.phase in _ALWAYS else []
        for event in TABLE[self.phase]:
            holds, follow = _LOOKS.get(event, (_never, _nothing))
            if holds(self, state, now_s):
                self._enter(event)
                return [*before, *follow(self, state, now_s)]
        return before

    def _renew_why(self, state: VehicleState, now_s: float) -> None:
        """Why it holds may change while it does."""
        if self.phase == "holding" and not self._paused:
            missing = self._trusted.blind if self._then == "climb" else self._trusted.silent
            self.why = missing(state, now_s) or self.why

    def _enter(self, event: Event) -> bool:
        phase = next_phase(self.phase, event)
        self.phase = phase or self.phase
        return phase is not None

    def _brake(
        self, event: Event, now_s: float, *, then: Literal["climb", "go"], why: str = "", paused: bool = False
    ) -> list[Action]:
        """Every stop on purpose. ``then``: what follows once it stands, or sees again; ``why`` it holds until then."""
        if not self._enter(event):
            return []
        self._then = then
        if self.phase == "stopping" or paused:
            self._paused = paused
        if self.phase == "holding":
            self.why = why
        return self._helm.stop(now_s)

    def _stay(self, event: Event, why: str, now_s: float, *, then: Literal["climb", "go"] = "go") -> list[Action]:
        """Until an order comes."""
        return self._brake(event, now_s, then=then, why=why, paused=True)

    def _set_out(self, variant: Variant, remaining: RemainingMission, trusted: frozenset[Sensor]) -> None:
        self.variant, self.remaining, self._trusted.sensors = variant, remaining, trusted

    # What follows.

    def _brake_again(self, _: VehicleState, now_s: float) -> list[Action]:
        return self._helm.stop(now_s)

    def _guide(self, _: VehicleState, now_s: float) -> list[Action]:
        return self._helm.change_mode(self._helm.guided_mode, now_s)

    def _go(self, state: VehicleState, now_s: float) -> list[Action]:
        if self._legs is None:
            return []
        if why := self._why_not_on(self._legs, state):
            return self.stop_at_fence(why, now_s)
        return self._legs.go(state, now_s)

    def _why_not_on(self, legs: Legs, state: VehicleState) -> str:
        """The mission's own line is certified; from where the vehicle is to it, and so high, it is not."""
        if legs.is_over:
            return ""
        highest_m = max(target.alt_rel_home_m for target in legs.left)
        return self.fence.why_not_along(state, legs.left[:1]) or self.fence.why_not_at(highest_m)

    def _back_off(self, state: VehicleState, now_s: float) -> list[Action]:
        self._backing = Backing(self._helm, self.trail, state, self._trusted.back_m(now_s))
        return self._backing.go(now_s)

    def _hold_unseen(self, _: VehicleState, now_s: float) -> list[Action]:
        self.why, self._then = self._trusted.hidden(now_s), "climb"
        return self._helm.stop(now_s)

    def _hold_unsure(self, state: VehicleState, now_s: float) -> list[Action]:
        self.why, self._then = self._why_unsure(state, now_s), "climb"
        return self._helm.stop(now_s)

    def _begin_climb(self, state: VehicleState, now_s: float) -> list[Action]:
        height_m, params = state.alt_rel_home_m or 0.0, self._params
        if self._plan_m is None:
            self._plan_m = height_m - self.offset_m
        self._climb = climb = Climb(
            self._helm,
            state,
            speed_m_s=params.climb_m_s,
            latency_s=params.latency_s,
            least_m=self.variant.least_m,
            ceiling_m=min(self._plan_m + params.ceiling_m, self.fence.highest_m) if self.variant.climbs_over else 0.0,
        )
        self.why = ""
        return [*climb.set_speed(now_s), *self.look(state, now_s)]

    def _count_on_whoever_sees(self, _: VehicleState, now_s: float) -> list[Action]:
        self._trusted.join(now_s)
        return []

    def _rise(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._climb is not None
        return self._climb.rise(state, now_s)

    def _level(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._climb is not None
        return self._climb.level(state, now_s)

    def _go_on_higher(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._climb is not None
        assert self._plan_m is not None
        reached_m = self._climb.ordered_m
        climbed_m = reached_m - self._plan_m
        if isinstance(way := self.variant, Way):
            self.offset_m = max(way.offset_m, climbed_m if way.climbs_over else 0.0)
            places = raised(way.places, max(0.0, reached_m - way.from_m))
            self._legs = Legs(self._helm, places, turns_first=not way.climbs_over)
            self._trusted.sensors |= way.lookouts
        else:
            self.offset_m = max(self.offset_m, climbed_m)
            self._legs = Legs(self._helm, self.remaining.raised(self.offset_m).targets)
        return self._hand_over(state, now_s)

    def _hand_over(self, state: VehicleState, now_s: float) -> list[Action]:
        """On along the legs, from the line or from where it is."""
        return self._go(state, now_s) or self.look(state, now_s)

    def _follow_legs(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._legs is not None
        return self._legs.on_look(state, now_s)

    def _go_on_after_way(self, state: VehicleState, now_s: float) -> list[Action]:
        self._leave_way()
        return self._go(state, now_s)

    def _leave_way(self) -> None:
        if isinstance(self.variant, Way):
            self.variant = self.variant.flown
            self._legs = Legs(self._helm, self.remaining.raised(self.offset_m).targets)

    def _wait_for_good(self, _: VehicleState, __: float) -> list[Action]:
        self._leave_way()
        self.why, self._paused = "The way is flown: it holds.", True
        return []

    def _end(self, _: VehicleState, now_s: float) -> list[Action]:
        self._leave_way()
        self.remaining, self.offset_m = replace(self.remaining, targets=()), 0.0
        return self._helm.change_mode(self.remaining.end.upper(), now_s)

    def _drop_flown(self, _: VehicleState, __: float) -> list[Action]:
        """Way and rest are what is still to be flown, at their planned heights."""
        assert self._legs is not None
        left = len(self._legs.left)
        if isinstance(self.variant, Way):
            self.variant = replace(self.variant, places=self.variant.places[-left:])
        else:
            self.remaining = replace(self.remaining, targets=self.remaining.targets[-left:])
        return []

    def _let_go(self, _: VehicleState, __: float) -> list[Action]:
        """What was flown tells nothing of a flight that follows."""
        self._helm.let_go()
        self.forget()
        return []

    def _fly_aside(self, state: VehicleState, now_s: float) -> list[Action]:
        actions, left, targets = self.aside.look(state, now_s), len(self.aside.left), self.remaining.targets
        if left < len(targets):
            self.remaining = replace(self.remaining, targets=targets[len(targets) - left :])
            self._legs = Legs(self._helm, self.remaining.raised(self.offset_m).targets)
        return actions


def _always(_: Detour, __: VehicleState, ___: float) -> bool:
    return True


def _never(_: Detour, __: VehicleState, ___: float) -> bool:
    return False


def _nothing(_: Detour, __: VehicleState, ___: float) -> list[Action]:
    return []


_Step = Callable[[Detour, VehicleState, float], list[Action]]
_ALWAYS: dict[Phase, _Step] = {
    "climbing": Detour._count_on_whoever_sees,
    "going": Detour._follow_legs,
    "aside": Detour._fly_aside,
}
"""Before a phase's events are looked for."""
_LOOKS: dict[Event, tuple[Callable[[Detour, VehicleState, float], bool], _Step]] = {
    "stands": (Detour._stands, Detour.look),
    "unheard": (Detour._is_unheard, Detour._brake_again),
    "not guided": (Detour._is_not_guided, Detour._guide),
    "ordered on": (Detour._goes_on_at_once, Detour._go),
    "too near": (Detour._is_too_near, Detour._back_off),
    "guided": (_always, Detour._begin_climb),
    "still unseen": (Detour._is_still_unseen, Detour._hold_unseen),
    "backed": (Detour._has_backed, Detour._begin_climb),
    "unsure": (Detour._is_unsure, Detour._hold_unsure),
    "clear": (Detour._is_clear, Detour._level),
    "highest": (Detour._is_highest, _nothing),
    "occupied": (_always, Detour._rise),
    "seen again": (Detour._sees_again, Detour.look),
    "level": (Detour._is_level, Detour._go_on_higher),
    "way flown": (Detour._has_flown_way, Detour._go_on_after_way),
    "flown for good": (Detour._has_flown_for_good, Detour._wait_for_good),
    "flown": (Detour._has_flown, Detour._end),
    "under way": (_always, Detour._drop_flown),
    "sure again": (Detour._is_sure_again, Detour.look),
    "returns": (Detour._returns, Detour._let_go),
    "on its line": (Detour._is_on_line, Detour._hand_over),
}
"""What is looked for, and what is done about it. All other events are orders."""
