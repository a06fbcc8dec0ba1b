"""Avoidance in flight, sans-IO: watches the regions ahead, stops and climbs when one is occupied, and lets go for good
when a person takes over (Bigazzi 2022, figs 9-10).

A flight that is too fast for the regions to stop in is slowed, on its way home, too. The link node and simulated
scenarios drive the same object.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from planning.basics.plan_model import Firmware
from telemetry.errors import NotAllowedError
from telemetry.flight.avoidance.avoiding_words import Now, status_of
from telemetry.flight.avoidance.coming_down import joined
from telemetry.flight.avoidance.detour import Detour
from telemetry.flight.avoidance.detour_state import DetourParams
from telemetry.flight.avoidance.fence_aboard import FenceAboard
from telemetry.flight.avoidance.pilot_watch import PilotWatch
from telemetry.flight.avoidance.regions import Regions, Sight, braking_of, largest_speed
from telemetry.flight.avoidance.slowing import Slowing
from telemetry.flight.guided.helm import Helm, from_the_same_home
from telemetry.flight.guided.remaining_mission import RemainingMission
from telemetry.mavlink.actions import Action, Message
from telemetry.mavlink.conversation import GROUND_STATION
from telemetry.topics.messages import FlightStatus, GuidedTarget
from telemetry.topics.obstacles import AvoidanceStatus, AvoidBy, PerceptionSettings, PerceptionStatus
from telemetry.topics.requests import FlyManoeuvre, FlyRest, MayFlyManoeuvre
from telemetry.topics.tracks import TracksStatus
from telemetry.topics.vehicle import VehicleState

LOW_M = 1.0
SHORT_M = 1.0
"""Left between the vehicle's hull and what it stops short of."""


class Avoiding:
    """Of one multirotor. All methods return what is to be sent to it, at once and in this order.

    ``remaining``: what is left of the flight, None when nothing is flown that could be gone on with. ``now_s`` is the
    clock of ``t_mono_s`` in states and perception. ``fence``: what is known of the one on board. ``on_engage`` is
    called when it takes the vehicle over, ``on_end`` when all is flown and the way home is commanded.
    """

    def __init__(
        self,
        target: tuple[int, int],
        *,
        remaining: Callable[[VehicleState], RemainingMission | None],
        settings: PerceptionSettings | None = None,
        params: DetourParams | None = None,
        fence: FenceAboard | None = None,
        firmware: Firmware = "ardupilot",
        own: tuple[int, int] = GROUND_STATION,
        on_engage: Callable[[], None] = lambda: None,
        on_end: Callable[[], None] = lambda: None,
    ) -> None:
        self._firmware: Firmware = firmware
        settings = self._braking_as_it_does(settings or PerceptionSettings())
        self._params, self._remaining = params or DetourParams().following(settings), remaining
        self._on_engage, self._on_end = on_engage, on_end
        self._watch = PilotWatch()
        self.regions = Regions(settings)
        self._helm = Helm(target, self._watch.asked, firmware=firmware, own=own)
        self.fence = fence or FenceAboard()
        self.fence.margin_m = settings.vehicle_radius_m + settings.position_error_m
        self.detour = Detour(self._helm, self.regions, self._params, self.fence)
        self.detour.aside.settings = settings
        self._state: VehicleState | None = None
        self.enabled = False
        self.by: AvoidBy = "climb"
        self.released = ""
        """Who has taken over; it stays off for this flight."""
        self._slowing = Slowing(self._helm)
        self._cannot = False
        self._now_s = 0.0

    @property
    def is_engaged(self) -> bool:
        """It hands over the vehicle's targets now."""
        return self.detour.is_engaged

    @property
    def status(self) -> AvoidanceStatus:
        now = Now(
            t_s=self._now_s,
            enabled=self.enabled,
            by=self.by,
            released=self.released,
            failed=self._helm.failed,
            cannot=self._cannot,
            speed_m_s=(self._state and self._state.ground_speed_m_s) or 0.0,
            slowed_to_m_s=self.slowed_to_m_s,
            slowed_as_late=self._slowing.as_late,
            fence_unread=self.fence.unread(self._state),
        )
        return status_of(now, self.regions, self.detour)

    @property
    def slowed_to_m_s(self) -> float | None:
        """The speed that was asked of a flight which was too fast to stop within what is seen."""
        return self._slowing.asked_m_s

    def flight_status(self, *, since_utc_s: float | None = None) -> FlightStatus:
        """Of a flight that it has taken over."""
        detour, target = self.detour, self.detour.target
        phase = {"holding": "paused", "ceiling": "paused", "ending": "returning"}.get(detour.phase, "flying")
        last = detour.remaining.targets[-1].item or None if detour.remaining.targets else None
        return FlightStatus(
            way=detour.remaining.way,
            phase=phase,  # type: ignore[arg-type]
            target=None if target is None else target.item or None,
            targets=last,
            since_utc_s=since_utc_s,
            hint=self.status.text,
        )

    # Switch.

    def enable(self, now_s: float, by: AvoidBy = "climb") -> None:
        """``by`` sidestep: it climbs only where it cannot step aside.

        Raises NotAllowedError after a release, until the vehicle has landed.
        """
        if self.released:
            raise NotAllowedError(
                f"Avoidance stays off for this flight. {self.released}", advice="Switch it on again after the landing."
            )
        if not self.enabled:
            self._watch.begin()
        self.enabled, self.by, self._now_s = True, by, now_s

    def disable(self, now_s: float) -> list[Action]:
        """A vehicle that has been taken over goes on as it is: higher than planned, and nothing stops it any more. On
        its way aside it holds: it does not go on choosing where to fly."""
        self.enabled, self._now_s = False, now_s
        self.detour.count_on_nobody()
        return self._end_aside(now_s)

    def _end_aside(self, now_s: float) -> list[Action]:
        wanted = self.enabled and self.by == "sidestep"
        return self.detour.stop_aside(now_s) if self.detour.phase == "aside" and not wanted else []

    def check_may_fly(self, request: FlyManoeuvre | MayFlyManoeuvre) -> None:
        """Raises NotAllowedError for a prepared way that may not be flown now."""
        state = self._state
        self._check_way(request)
        if state is None or not _is_flying(state):
            raise NotAllowedError("The vehicle is not in the air.", advice="A way around is flown in flight.")
        if why := self.fence.why_not_along(state, request.targets):
            raise NotAllowedError(why, advice="Fly another way, or return.")
        if self.released:
            raise NotAllowedError(self.released, advice="The pilot flies the vehicle.")
        if state.mode not in self._helm.orders.flown_from:
            raise NotAllowedError(f"The vehicle is flown in {state.mode}, by hand.", advice="Pause it first.")

    def fly(self, request: FlyManoeuvre, remaining: RemainingMission, now_s: float) -> list[Action]:
        """A prepared way, then ``remaining`` higher by what the request says. Raises NotAllowedError."""
        self.check_may_fly(request)
        if not self.enabled and not self.is_engaged:
            self._watch.begin()  # what anybody did before this order releases nothing
        self._on_engage()
        if request.kind == "sidestep":
            return self.detour.sidestep(request.targets, remaining, now_s=now_s)
        return self.detour.fly(
            request.targets, remaining, over=request.kind == "over", offset_m=request.height_offset_m, now_s=now_s
        )

    def fly_rest(self, request: FlyRest, now_s: float) -> list[Action]:
        """At the request's heights. Raises NotAllowedError when it does not go on higher, or something is ahead."""
        state, detour = self._state, self.detour
        _check_targets(request.targets)
        if state is None or self.released or not detour.goes_higher:
            raise NotAllowedError("No flight goes on higher than planned.", advice="Nothing is to be done.")
        if self.regions.occupied(now_s) or not self.regions.fresh(now_s):
            raise NotAllowedError("The way ahead is not seen to be clear.", advice="It is planned again.")
        targets = joined(request.targets, state, self.regions.braking)
        if why := self.fence.why_not_along(state, targets):
            raise NotAllowedError(f"The lower line is not flown. {why}", advice="It stays higher.")
        return detour.come_down(targets, state, now_s)

    def _check_way(self, request: FlyManoeuvre | MayFlyManoeuvre) -> None:
        _check_targets(request.targets)
        if not math.isfinite(request.height_offset_m):
            raise NotAllowedError("The way has a place that is no number.", advice="Prepare it again.")
        if request.height_offset_m > self._params.ceiling_m + LOW_M:
            what = f"It is {request.height_offset_m:.0f} m above the plan; {self._params.ceiling_m:g} m are the most."
            raise NotAllowedError(what, advice="Fly around it.")

    def pause(self, now_s: float) -> list[Action]:
        return self.detour.pause(now_s)

    def resume(self, now_s: float) -> list[Action]:
        return [] if self._state is None else self.detour.resume(self._state, now_s)

    def stop(self) -> None:
        """Another command for the vehicle follows: it is let go."""
        self._helm.let_go()
        self.detour.forget()

    # What comes in.

    def commanded(self, mode: str, now_s: float) -> None:
        """A flight mode that this ground station has asked for by other means: it is no pilot's."""
        self._watch.asked(mode, now_s)

    def on_settings(self, settings: PerceptionSettings) -> None:
        settings = self._braking_as_it_does(settings)
        self._params = self._params.following(settings)
        self.detour.set_params(self._params)
        self.regions.settings = self.detour.aside.settings = settings
        self.fence.margin_m = settings.vehicle_radius_m + settings.position_error_m

    def _braking_as_it_does(self, settings: PerceptionSettings) -> PerceptionSettings:
        braking = braking_of(self._firmware, settings.brake_decel_m_s2, settings.brake_jerk_m_s3)
        return replace(settings, brake_decel_m_s2=braking.decel_m_s2, brake_jerk_m_s3=braking.jerk_m_s3)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        """Any of the vehicle, and those by which others fly it by hand."""
        self._watch.on_message(message)
        return [*self._helm.on_message(message, now_s), *self._look(now_s)]

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        if self._state is not None and self.is_engaged and self._helm.orders.counts_from_sea:
            state = from_the_same_home(state, self._state)
        self._state = state
        self._slowing.on_state(state)
        self.detour.trail.on_state(state)
        if self.released and state.mode != self._helm.guided_mode:
            self._helm.let_go()
        lands = self.is_engaged and state.armed and state.landed == "landing"  # it may show before the mode does
        if _is_flying(state) or lands:
            self._watch.on_state(state, now_s)
        else:
            self._on_ground(state)
        return [*self._helm.on_state(state, now_s), *self._look(now_s)]

    def on_perception(self, status: PerceptionStatus, now_s: float) -> list[Action]:
        self.regions.take(status, now_s)
        return self._look(now_s)

    def on_tracks(self, status: TracksStatus, now_s: float) -> list[Action]:
        self.detour.aside.on_tracks(status)
        return self._look(now_s)

    def on_tick(self, now_s: float) -> list[Action]:
        return [*self._helm.on_tick(now_s), *self._look(now_s)]

    # What follows.

    def _on_ground(self, state: VehicleState) -> None:
        self._watch.begin()
        if not state.armed:
            self._slowing.forget()
        if not state.armed and (self.is_engaged or self.released):
            self.released = ""
            self.stop()

    def _look(self, now_s: float) -> list[Action]:
        state, self._now_s = self._state, now_s
        self._helm.most_m_s = self._most_m_s(now_s)
        if state is None or self.released:
            return []
        if self._watch.words and (self.enabled or self.is_engaged):
            return self._release(state, now_s)
        if ended := self._end_aside(now_s):
            return ended
        was_ending = self.detour.phase == "ending"
        actions = self.detour.look(state, now_s)
        if self.detour.phase == "ending" and not was_ending:
            self._on_end()
        if not actions and self.detour.goes_over:
            seen_by = self.regions.seen_by(now_s)
            return self.detour.climb_on(seen_by, now_s) if seen_by else self.detour.hold_if_silent(state, now_s)
        if not actions and self.detour.goes_past:
            blocked = self._is_blocked(state, now_s)
            return self.detour.stop_short(now_s) if blocked else self.detour.hold_if_silent(state, now_s)
        if self.detour.phase == "aside":
            return self._climb_if_blocked(state, now_s) or actions
        if self.enabled and not actions:
            actions = self._look_aside(state, now_s) or self._look_ahead(state, now_s)
        return actions

    def _look_aside(self, state: VehicleState, now_s: float) -> list[Action]:
        """Steps aside, where that is chosen and leads past what is in the way, sooner than a region ahead begins."""
        going = self.detour.phase == "going" and not self.detour.is_manoeuvre
        if self.by != "sidestep" or not _is_flying(state) or (self.is_engaged and not going):
            return []
        remaining = self.detour.remaining if going else self._remaining(state)
        if remaining is None or not self.detour.aside.wants(
            state, remaining.raised(self.detour.offset_m).targets, now_s
        ):
            return []
        self._on_engage()
        return self.detour.step_aside(state, remaining, now_s)

    def _climb_if_blocked(self, state: VehicleState, now_s: float) -> list[Action]:
        """On the way aside something stands so near ahead that it must brake now, or there is no way on."""
        seen_by, is_stuck = self.regions.seen_by(now_s), self.detour.aside.is_stuck(now_s)
        if seen_by and (is_stuck or self._is_blocked(state, now_s)):
            return self.detour.avoid_again(seen_by, now_s)
        return self.detour.give_up_aside(state, now_s) if is_stuck and self.regions.counted(now_s) else []

    def _is_blocked(self, state: VehicleState, now_s: float) -> bool:
        """Whether something ahead is so near that it must brake now; what it flies alongside is not ahead."""
        heading_rad = state.heading_rad or 0.0
        north_m_s, east_m_s = state.v_north_m_s or 0.0, state.v_east_m_s or 0.0
        speed_m_s = max(0.0, north_m_s * math.cos(heading_rad) + east_m_s * math.sin(heading_rad))
        return any(
            (sight.distance_m or 0.0) <= self._stopping_m(sight, speed_m_s) for sight in self.regions.occupied(now_s)
        )

    def _stopping_m(self, sight: Sight, speed_m_s: float) -> float:
        return self.regions.stopping(sight).distance_m(speed_m_s) + SHORT_M

    def _look_ahead(self, state: VehicleState, now_s: float) -> list[Action]:
        going, self._cannot = self.detour.phase == "going" and not self.detour.is_manoeuvre, False
        if self.is_engaged and not going:
            return []
        seen_by = self.regions.seen_by(now_s)
        if not seen_by:
            actions = self.detour.hold_if_silent(state, now_s) if going else []
            return actions or self._slow_down(state, now_s)
        if going:
            return self.detour.avoid_again(seen_by, now_s)
        remaining = self._remaining(state) if _is_flying(state) else None
        if remaining is None:
            self._cannot = _is_flying(state)
            return []
        self._on_engage()
        return self.detour.avoid(remaining, seen_by, now_s)

    def _slow_down(self, state: VehicleState, now_s: float) -> list[Action]:
        """What is flown by no pilot: the mission, the script, the way home."""
        largest_m_s = self.largest_speed_m_s(now_s)
        if largest_m_s is None or not _is_flying(state) or state.mode not in self._helm.orders.flown_from:
            return []
        is_late = any(sight.is_late for sight in self.regions.eyes(now_s))
        return self._slowing.look(state, largest_m_s, now_s, is_late=is_late)

    def _most_m_s(self, now_s: float) -> float:
        """Of what is ordered here. Who flies without avoidance flies as fast as planned."""
        largest_m_s = self.largest_speed_m_s(now_s) if self.enabled else None
        return math.inf if largest_m_s is None else largest_speed(largest_m_s)

    def largest_speed_m_s(self, now_s: float) -> float | None:
        """At which every region that counts now still suffices to stop in."""
        slowest = self.regions.slowest(now_s)
        return None if slowest is None else slowest[1]

    def _release(self, state: VehicleState, now_s: float) -> list[Action]:
        """Where a stick was moved and the mode still is ours the vehicle is stopped once; then nothing more is sent."""
        self.released = self._watch.words
        was_engaged = self.is_engaged
        self.stop()
        return self._helm.stop(now_s) if was_engaged and state.mode == self._helm.guided_mode else []


def _check_targets(targets: tuple[GuidedTarget, ...]) -> None:
    if not targets:
        raise NotAllowedError("The way has no places.", advice="Prepare it again.")
    numbers = [n for t in targets for n in (t.lat_deg, t.lon_deg, t.alt_rel_home_m, t.speed_m_s, t.loiter_s)]
    if not all(map(math.isfinite, numbers)):
        raise NotAllowedError("The way has a place that is no number.", advice="Prepare it again.")


def _is_flying(state: VehicleState) -> bool:
    if state.landed is None:
        return state.armed and (state.alt_rel_home_m or 0.0) > LOW_M
    return state.armed and state.landed == "in_air"
