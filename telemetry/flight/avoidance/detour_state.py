"""How a detour stands, and what each look at it may find: no order is made of it here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from telemetry.flight.avoidance.aside import Aside
from telemetry.flight.avoidance.backing import Backing, Trail
from telemetry.flight.avoidance.climb import Climb
from telemetry.flight.avoidance.fence_aboard import FenceAboard
from telemetry.flight.avoidance.phases import Avoid, Over, Past, Phase, Variant
from telemetry.flight.avoidance.regions import Regions
from telemetry.flight.avoidance.trusted_sensors import TrustedSensors
from telemetry.flight.guided.helm import Helm
from telemetry.flight.guided.legs import Legs
from telemetry.flight.guided.remaining_mission import RemainingMission
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.vehicle import VehicleState

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


class DetourState:
    def __init__(self, helm: Helm, regions: Regions, params: DetourParams, fence: FenceAboard | None = None) -> None:
        self._helm, self._regions, self._params = helm, regions, params
        self.fence = fence or FenceAboard()
        self.trail = Trail()
        self.aside = Aside(helm, self.fence)
        self.forget()

    def forget(self) -> None:
        """Another flight, or somebody else flies."""
        self.phase: Phase = "idle"
        self.variant: Variant = Avoid()
        self.why = ""
        """It holds."""
        self.remaining = RemainingMission((), "hold")
        self.offset_m = 0.0
        self.came_down = False
        self._trusted = TrustedSensors(self._regions)
        self._paused = False
        self._then: Literal["climb", "go"] = "climb"
        """Once it has stopped."""
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
    def is_paused(self) -> bool:
        """It holds until an order comes."""
        return self.phase == "holding" and self._paused

    @property
    def is_manoeuvre(self) -> bool:
        return self.variant.is_manoeuvre

    @property
    def target(self) -> GuidedTarget | None:
        if self._legs is not None and not self.is_manoeuvre:
            return self._legs.target
        return self.remaining.targets[0] if self.remaining.targets else None

    @property
    def is_below_fence(self) -> bool:
        """It is the fence that ends its climb, sooner than the highest that is allowed above the plan."""
        return self._plan_m is not None and self.fence.highest_m < self._plan_m + self._params.ceiling_m

    @property
    def goes_higher(self) -> bool:
        """On the rest of the flight, above the plan."""
        return self.phase == "going" and not self.is_manoeuvre and self.offset_m > 0.0

    @property
    def goes_over(self) -> bool:
        return self.phase == "going" and isinstance(self.variant, Over)

    @property
    def goes_past(self) -> bool:
        return self.phase == "going" and isinstance(self.variant, Past)

    # What a look may find.

    def _stands(self, state: VehicleState, now_s: float) -> bool:
        return self._helm.has_stopped(state, now_s)

    def _is_unheard(self, state: VehicleState, now_s: float) -> bool:
        """The order to stop was never answered, the link is back, and nobody has taken over."""
        heard_s = state.heartbeat_t_mono_s
        is_back = heard_s is not None and now_s - heard_s <= HEARD_S
        return bool(self._helm.failed) and is_back and not self._stands(state, now_s)

    def _is_not_guided(self, state: VehicleState, _: float) -> bool:
        return state.mode != self._helm.guided_mode

    def _goes_on_at_once(self, _: VehicleState, __: float) -> bool:
        return self._then == "go"

    def _is_too_near(self, _: VehicleState, now_s: float) -> bool:
        return self.variant.climbs_over and self._trusted.back_m(now_s) > 0.0

    def _has_backed(self, state: VehicleState, now_s: float) -> bool:
        assert self._backing is not None
        return self._backing.is_over(state, now_s)

    def _is_still_unseen(self, state: VehicleState, now_s: float) -> bool:
        return self._has_backed(state, now_s) and self._trusted.hidden(now_s) != ""

    def _why_unsure(self, state: VehicleState, now_s: float) -> str:
        """Why nobody can tell whether the way is clear; empty while it can be seen, or need not be."""
        blind = self._trusted.blind(state, now_s)
        return blind or (self._trusted.hidden(now_s) if self.variant.climbs_over else "")

    def _is_unsure(self, state: VehicleState, now_s: float) -> bool:
        return self._why_unsure(state, now_s) != ""

    def _is_clear(self, state: VehicleState, now_s: float) -> bool:
        assert self._climb is not None
        is_clear = not self.variant.climbs_over or self._trusted.say_clear(now_s)
        return self._climb.is_high_enough(state) and is_clear  # Bigazzi 2022, fig. 9

    def _is_highest(self, state: VehicleState, _: float) -> bool:
        assert self._climb is not None
        return self._climb.is_at_ceiling(state)

    def _sees_again(self, _: VehicleState, now_s: float) -> bool:
        return self.variant.climbs_over and bool(self._regions.occupied(now_s))

    def _is_level(self, state: VehicleState, _: float) -> bool:
        assert self._climb is not None
        return self._climb.is_level(state)

    def _has_flown_way(self, state: VehicleState, now_s: float) -> bool:
        return self.is_manoeuvre and bool(self.remaining.targets) and self._has_flown(state, now_s)

    def _has_flown_for_good(self, state: VehicleState, now_s: float) -> bool:
        return self.remaining.end == "hold" and self._has_flown(state, now_s)

    def _has_flown(self, _: VehicleState, __: float) -> bool:
        assert self._legs is not None
        return self._legs.is_over

    def _is_sure_again(self, state: VehicleState, now_s: float) -> bool:
        missing = self._why_unsure if self._then == "climb" else self._trusted.silent
        return self._stands(state, now_s) and not self._paused and not missing(state, now_s)

    def _returns(self, state: VehicleState, _: float) -> bool:
        return state.mode == self.remaining.end.upper()

    def _is_on_line(self, _: VehicleState, now_s: float) -> bool:
        return self.aside.is_back(now_s)
