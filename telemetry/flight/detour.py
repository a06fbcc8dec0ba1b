"""What is flown instead of the mission: stop, climb straight up until it is clear, go on in GUIDED, that much higher.

Bigazzi 2022, figs 9-10: velocity V1 until something is inside the region, then V2 (climb) until it is clear, then V1
again at the new altitude. Before the climb the vehicle is brought to a stand: it does not drift into what it saw.
Where it stands too near to see what is in the way, it first goes back on the way that it came.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from telemetry.flight.aside import Aside
from telemetry.flight.backing import Backing, Trail
from telemetry.flight.climb import Climb
from telemetry.flight.helm import GUIDED, Helm
from telemetry.flight.legs import Legs
from telemetry.flight.regions import Regions
from telemetry.flight.rest import Rest
from telemetry.flight.witnesses import Witnesses
from telemetry.mavlink.actions import Action
from telemetry.messages import GuidedTarget
from telemetry.obstacles import PerceptionSettings, Sensor
from telemetry.vehicle import VehicleState

Phase = Literal[
    "idle", "stopping", "taking", "backing", "climbing", "levelling", "going", "holding", "ceiling", "ending", "aside"
]
HEARD_S = 2.0
"""A heartbeat as young as this shows the vehicle's mode."""


@dataclass(frozen=True, slots=True)
class DetourParams:
    climb_m_s: float = 1.5
    """V2"""
    ceiling_m: float = 30.0
    """Above the plan."""
    latency_s: float = 0.3
    """From seeing to braking."""

    def following(self, settings: PerceptionSettings) -> DetourParams:
        """With what the operator has set."""
        return replace(self, climb_m_s=settings.climb_m_s, ceiling_m=settings.climb_ceiling_m)


class Detour:
    """``look`` is called whenever anything is new; what it returns is to be sent at once."""

    def __init__(self, helm: Helm, regions: Regions, params: DetourParams) -> None:
        self._helm, self._regions, self._params = helm, regions, params
        self.trail = Trail()
        self.aside = Aside(helm)
        self.forget()

    def forget(self) -> None:
        """Another flight, or somebody else flies."""
        self.phase: Phase = "idle"
        self.why = ""
        """It holds."""
        self.rest = Rest((), "hold")
        self.offset_m = 0.0
        self.came_down = False
        self._witnesses = Witnesses(self._regions)
        self._lookouts: frozenset[Sensor] = frozenset()
        """Who is counted on along a prepared way: those who saw what it leads past, else all that work."""
        self.is_manoeuvre = self._sidesteps = False
        self._paused = False
        self._then: Literal["climb", "go"] = "climb"
        self._over = True
        self._way: tuple[GuidedTarget, ...] = ()
        self._least_m = self._wanted_offset_m = self._way_from_m = 0.0
        self._plan_m: float | None = None
        """Height of the plan where the vehicle stands."""
        self._backing: Backing | None = None
        self._climb: Climb | None = None
        self._legs: Legs | None = None

    def set_params(self, params: DetourParams) -> None:
        """Of the next climb; one that has begun goes on as it is."""
        self._params = params

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
        self.rest, self.is_manoeuvre, self._over, self._way = rest, False, True, ()
        self._witnesses.sensors = seen_by
        self._regions.rely()
        self._least_m, self._plan_m = 0.0, None
        return self._stop(now_s, then="climb")

    def avoid_again(self, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """On the rest of the flight, too."""
        return self.avoid(self.rest, seen_by, now_s)

    def fly(
        self, way: tuple[GuidedTarget, ...], rest: Rest, *, over: bool, offset_m: float, now_s: float
    ) -> list[Action]:
        """A prepared way, then the rest ``offset_m`` higher than planned. ``over``: climbs on while it is not clear."""
        self.rest, self.is_manoeuvre, self._over, self._way = rest, True, over, way
        self._witnesses.sensors = frozenset()
        self._lookouts = self._regions.seen_by(now_s) or frozenset(self._regions.counted(now_s))
        self._sidesteps = False
        self._least_m = self._way_from_m = way[0].alt_rel_home_m
        self._plan_m = None
        self._wanted_offset_m = max(offset_m, self.offset_m)
        return self._stop(now_s, then="climb")

    def sidestep(self, way: tuple[GuidedTarget, ...], rest: Rest, *, now_s: float) -> list[Action]:
        """At once: who brakes first stays where the moving object is expected. The rest is as high as it was."""
        self.rest, self.is_manoeuvre, self._over, self._way = rest, True, False, way
        self._witnesses.sensors = frozenset()
        self._least_m = self._way_from_m = way[0].alt_rel_home_m
        self._plan_m, self._wanted_offset_m = None, self.offset_m
        self._legs, self._sidesteps = Legs(self._helm, way), True
        self.phase, self._then, self._paused = "taking", "go", False
        return self._helm.change_mode(GUIDED, now_s)

    def step_aside(self, state: VehicleState, rest: Rest, now_s: float) -> list[Action]:
        """Past what the tracks say, along the rest of the flight and back onto its line."""
        self.rest, self.is_manoeuvre, self._over, self._way = rest, False, False, ()
        self._witnesses.sensors = frozenset()
        targets = rest.raised(self.offset_m).targets
        self.phase, self._then, self._legs = "aside", "go", Legs(self._helm, targets)
        self.aside.begin(state, targets)
        return self._on_aside(state, now_s)

    def _on_aside(self, state: VehicleState, now_s: float) -> list[Action]:
        actions, left = self.aside.look(state, now_s), len(self.aside.left)
        if left < len(self.rest.targets):
            self.rest = replace(self.rest, targets=self.rest.targets[len(self.rest.targets) - left :])
            self._legs = Legs(self._helm, self.rest.raised(self.offset_m).targets)
        return [*actions, *self._go_back(state, now_s)] if self.aside.is_back(now_s) else actions

    def give_up_aside(self, state: VehicleState, now_s: float) -> list[Action]:
        """On towards what it cannot pass, slowly enough to stop, until a region shows it: then it is climbed over."""
        self.aside.give_up(now_s)
        return [*self._helm.change_mode(GUIDED, now_s), *self._go_back(state, now_s)]

    def _go_back(self, state: VehicleState, now_s: float) -> list[Action]:
        """On with the rest, from the line or from where it is."""
        assert self._legs is not None
        self.phase = "going"
        return self._legs.go(state, now_s) or self._on_going(state, now_s)

    @property
    def goes_higher(self) -> bool:
        """On the rest of the flight, above the plan."""
        return self.phase == "going" and not self.is_manoeuvre and self.offset_m > 0.0

    def come_down(self, targets: tuple[GuidedTarget, ...], state: VehicleState, now_s: float) -> list[Action]:
        """The rest at heights of its own, which are certified past what was seen."""
        self.rest, self.offset_m, self.came_down = replace(self.rest, targets=targets), 0.0, True
        self._legs = Legs(self._helm, targets)
        return self._legs.go(state, now_s)

    @property
    def goes_over(self) -> bool:
        """On a prepared way over something, whose top may not have been seen yet."""
        return self.phase == "going" and self.is_manoeuvre and self._over

    @property
    def goes_past(self) -> bool:
        """On a prepared way beside something, of which it has seen only what was in sight.

        Not on a sidestep: who brakes there stays where the moving object is expected, whose own echoes stop it.
        """
        return self.phase == "going" and self.is_manoeuvre and not self._over and not self._sidesteps

    def stop_short(self, now_s: float) -> list[Action]:
        """The prepared way is not clear: it holds, and whoever ordered it decides."""
        return self._stay("Something stands on the way past: it holds. Fly another way, or return.", now_s)

    def stop_aside(self, now_s: float) -> list[Action]:
        """Nobody wants it to step aside any more: beside its line it holds, and goes back there at an order only."""
        return self._stay("Stepping aside was switched off: it holds. Resume goes on along its line.", now_s)

    def _stay(self, why: str, now_s: float) -> list[Action]:
        actions = self._stop(now_s, then="go")
        self.phase, self._paused, self.why = "holding", True, why
        return actions

    def climb_on(self, seen_by: frozenset[Sensor], now_s: float) -> list[Action]:
        """The prepared way was not high enough."""
        self._witnesses.sensors, self._least_m = seen_by, 0.0
        return self._stop(now_s, then="climb")

    def pause(self, now_s: float) -> list[Action]:
        """The operator wants it to stay where it is."""
        then = "go" if self.phase == "going" else self._then
        actions = self._stop(now_s, then=then)
        self.phase, self._paused, self.why = "holding", True, "Paused."
        return actions

    def resume(self, state: VehicleState, now_s: float) -> list[Action]:
        if self.phase == "ceiling" and self._witnesses.say_clear(now_s):
            return self._level(state, now_s)
        if self.phase == "aside" and self.aside.why:
            return self.give_up_aside(state, now_s)
        if not self._paused:
            if self.phase == "holding":
                self.count_on_nobody()
            return []
        self._paused, self.why = False, ""
        self.phase = "stopping"
        return self.look(state, now_s)

    # What follows from what is seen.

    def look(self, state: VehicleState, now_s: float) -> list[Action]:
        steps = {
            "stopping": self._on_stopping,
            "taking": self._on_taking,
            "backing": self._on_backing,
            "climbing": self._on_climbing,
            "levelling": self._on_levelling,
            "going": self._on_going,
            "holding": self._on_holding,
            "ending": self._on_ending,
            "aside": self._on_aside,
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
        back_m = self._witnesses.back_m(now_s) if self._over else 0.0
        if back_m > 0.0:
            self.phase, self._backing = "backing", Backing(self._helm, self.trail, state, back_m)
            return self._backing.go(now_s)
        return self._begin_climb(state, now_s)

    def _on_backing(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._backing is not None
        if not self._backing.is_over(state, now_s):
            return []
        if why := self._witnesses.hidden(now_s):
            return self._hold(why, now_s, then="climb")
        return self._begin_climb(state, now_s)

    def _begin_climb(self, state: VehicleState, now_s: float) -> list[Action]:
        height_m, params = state.alt_rel_home_m or 0.0, self._params
        if self._plan_m is None:
            self._plan_m = height_m - self.offset_m
        self._climb = climb = Climb(
            self._helm,
            state,
            speed_m_s=params.climb_m_s,
            latency_s=params.latency_s,
            least_m=self._least_m,
            ceiling_m=self._plan_m + params.ceiling_m if self._over else 0.0,
        )
        self.phase, self.why = "climbing", ""
        return [*climb.set_speed(now_s), *self._on_climbing(state, now_s)]

    def _on_climbing(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._climb is not None
        self._witnesses.join(now_s)
        if why := self._why_not_clear(state, now_s):
            return self._hold(why, now_s, then="climb")
        if self._climb.is_high_enough(state) and self._is_clear(now_s):
            return self._level(state, now_s)
        if self._climb.is_at_ceiling(state):
            self.phase = "ceiling"
            return []
        return self._climb.rise(state, now_s)

    def _why_not_clear(self, state: VehicleState, now_s: float) -> str:
        """Why nobody can tell whether the way is clear; empty while it can be seen, or need not be."""
        blind = self._witnesses.blind(state, now_s)
        return blind or (self._witnesses.hidden(now_s) if self._over else "")

    def _is_clear(self, now_s: float) -> bool:
        return not self._over or self._witnesses.say_clear(now_s)

    def _level(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._climb is not None
        self.phase = "levelling"
        return self._climb.level(state, now_s)

    def _on_levelling(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._climb is not None
        if why := self._why_not_clear(state, now_s):
            return self._hold(why, now_s, then="climb")
        if self._over and self._regions.occupied(now_s):
            self.phase = "climbing"
            return self._on_climbing(state, now_s)
        return self._go_on(state, now_s) if self._climb.is_level(state) else []

    def _go_on(self, state: VehicleState, now_s: float) -> list[Action]:
        """At the new height."""
        assert self._climb is not None
        assert self._plan_m is not None
        reached_m = self._climb.ordered_m
        climbed_m = reached_m - self._plan_m
        self.phase = "going"
        if self.is_manoeuvre:
            extra_m = max(0.0, reached_m - self._way_from_m)
            self.offset_m = max(self._wanted_offset_m, climbed_m if self._over else 0.0)
            self._legs = Legs(self._helm, _raised(self._way, extra_m), turns_first=not self._over)
            self._witnesses.sensors |= self._lookouts
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

    def hold_if_silent(self, state: VehicleState, now_s: float) -> list[Action]:
        """On the way past and on the rest of the flight: not without the frames of those who saw what stands there."""
        why = self._witnesses.silent(state, now_s)
        return self._hold(why, now_s, then="go") if why else []

    def count_on_nobody(self) -> None:
        """The rest of the flight is gone on with, whether anybody looks ahead or not."""
        self._lookouts = frozenset()
        if self.phase == "going" or self._then == "go":
            self._witnesses.sensors = frozenset()

    def _hold(self, why: str, now_s: float, *, then: Literal["climb", "go"]) -> list[Action]:
        self.phase, self.why, self._then = "holding", why, then
        return self._helm.stop(now_s)

    def _on_holding(self, state: VehicleState, now_s: float) -> list[Action]:
        if not self._helm.has_stopped(state, now_s):
            return self._stop_again_if_unheard(state, now_s)
        missing = self._why_not_clear if self._then == "climb" else self._witnesses.silent
        if self._paused or missing(state, now_s):
            return []
        self.phase = "taking"
        return self._on_taking(state, now_s)


def _raised(targets: tuple[GuidedTarget, ...], by_m: float) -> tuple[GuidedTarget, ...]:
    return tuple(replace(t, alt_rel_home_m=t.alt_rel_home_m + by_m) for t in targets)
