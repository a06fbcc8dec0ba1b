"""The navigation script of Melita 2020, section 7, sans-IO: targets are handed over one at a time.

Take-off, then each target when the one before was reached and its loiter time has passed, then the way home. It never
skips a target, waits while the link is down, and ends as soon as somebody else chooses another flight mode. A vehicle
that does not fly straight from place to place is led along the leg (``feed``). A certified way begins in the air, from
where it was certified, and may end with holding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from planning.basics.plan_model import Firmware
from telemetry.errors import NotAllowedError, SilentError, TelemetryError
from telemetry.flight.guided.beginning import HOME_SHOWS_S, home_elsewhere, is_off_the_ground, why_not_from
from telemetry.flight.guided.feed import Feed
from telemetry.flight.guided.handover import Handover, away_m, is_fresh
from telemetry.flight.guided.leading import Leading
from telemetry.flight.guided.orders import GuidedOrders, Place
from telemetry.flight.guided.pending_command import PendingCommand, Then
from telemetry.flight.guided.script_watches import HomeWatched, ModeWatch, Punctuality, Standstill
from telemetry.flight.guided.vehicle_and_home import Whereabouts
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send
from telemetry.mavlink.conversation import GROUND_STATION, Endpoints
from telemetry.topics.messages import FlightPhase, FlightStatus, GuidedTarget
from telemetry.topics.requests import FlyWay, StartGuided
from telemetry.topics.vehicle import VehicleState

TAKEOFF_TOLERANCE_M = 0.3
RETURN_AGAIN_S = 2.0
SLOW_TARGET_SENDINGS = 4
THERE = "The way is flown: it holds there."


@dataclass(frozen=True, slots=True)
class GuidedEnd:
    completed: bool
    words: str


class GuidedScript:
    """Ends in Done(GuidedEnd), or in Failed before take-off. Feed it states, messages and ticks of one clock."""

    def __init__(
        self,
        request: StartGuided | FlyWay,
        state: VehicleState,
        *,
        firmware: Firmware,
        target: tuple[int, int],
        own: tuple[int, int] = GROUND_STATION,
        note: str = "",
        feed: Feed | None = None,
    ) -> None:
        """``note``: said of the flight while there is nothing else to say. ``feed``: for ArduPilot only."""
        self._note = note
        self._leading = None if feed is None else Leading(feed)
        self._request, self._endpoints, self._orders = request, Endpoints(target, own), GuidedOrders(firmware, target)
        certified = request.home if isinstance(request, FlyWay) else None
        self._home_watched = HomeWatched(request.spare_m, certified)
        self._watch, self._punctuality = ModeWatch(), Punctuality()
        self._targets = request.targets
        self._takeoff_m = request.takeoff_alt_rel_home_m if isinstance(request, StartGuided) else -math.inf
        self.phase: FlightPhase = "idle"
        self.hint = ""
        self.broke_off_at: int | None = None
        self._index = 0
        self._state = state
        self._whereabouts = Whereabouts(state)
        self._pending = PendingCommand(self._endpoints, self._on_failed_command)
        self._handover: Handover | None = None
        self._speed_m_s: float | None = None
        self._reached_s: float | None = None
        self._return_at_s = 0.0
        self._standstill, self._stands = Standstill(), ""
        self._home_shows_by_s: float | None = None
        """Until then it is armed and waits for its home."""
        self.ends_held = ""
        """Why it ends once the vehicle holds where it was; empty: it does not."""

    @property
    def is_over(self) -> bool:
        return self.phase in ("landed", "interrupted")

    @property
    def _is_way(self) -> bool:
        return isinstance(self._request, FlyWay)

    @property
    def is_flown(self) -> bool:
        """All targets were reached."""
        return self._index >= len(self._targets)

    @property
    def target(self) -> GuidedTarget:
        """That is flown to, or was last."""
        return self._targets[min(self._index, len(self._targets) - 1)]

    @property
    def left(self) -> tuple[GuidedTarget, ...]:
        """From the target that is flown to."""
        return self._targets[self._index :]

    @property
    def end(self) -> Literal["rtl", "land", "hold"]:
        """What follows the last target."""
        return self._request.end

    @property
    def behind_s(self) -> float | None:
        """How much later than planned the script is; negative when it is ahead."""
        return self._punctuality.behind_s

    def status(self, *, since_utc_s: float | None = None) -> FlightStatus:
        late = "" if self.behind_s is None or self.behind_s < 1 else f"{self.behind_s:.0f} s behind the plan."
        return FlightStatus(
            way="guided",
            phase="paused" if self.phase == "arming" and self._is_way else self.phase,
            target=self.target.item or None,
            targets=self._targets[-1].item or None,
            since_utc_s=since_utc_s,
            broke_off_at=self.broke_off_at,
            is_flown=self.phase == "paused" and self.is_flown,
            hint=self.hint or self._stands or late or (self._note if self.phase in ("taking_off", "flying") else ""),
        )

    def start(self, now_s: float) -> list[Action]:
        """Failed(NotAllowedError) where it does not begin: a mission's in flight, a certified way anywhere else."""
        self.phase, state = "arming", self._state
        if not self._targets:
            return self._fail(NotAllowedError("The script has no targets.", advice="Plan a mission first."))
        refusal = why_not_from(self._request, state, now_s)
        if refusal is not None:
            return self._fail(refusal)
        if math.isnan(self._whereabouts.home_alt_amsl_m):
            return self._fail(
                NotAllowedError("The vehicle does not know its height yet.", advice="Wait for its position.")
            )
        self._watch.expect(self._orders.script_modes, before=frozenset({state.mode}))
        begins = self._set_out if self._is_way else self._arm
        return self._change_mode(self._orders.guided_mode, now_s, then=begins)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self.is_over or not self._endpoints.is_from_vehicle(message):
            return []
        if message.get_type() == "POSITION_TARGET_GLOBAL_INT" and self._handover is not None:
            self._handover.on_position_target(message, now_s)
        return self._pending.on_message(message, now_s)

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        if self.is_over:
            return []
        self._state = state
        self._whereabouts.note(state)
        actions = self._pending.on_state(state, now_s)
        if not self.is_over:
            actions += self._look(state, now_s)
        return actions

    def on_tick(self, now_s: float) -> list[Action]:
        if self.is_over:
            return []
        actions = self._pending.on_tick(now_s)
        if not self.is_over:
            actions += self._look(self._state, now_s)
        return actions

    def pause(self, now_s: float) -> list[Action]:
        """Holds the position, during the take-off as soon as it is up; before the take-off it ends the script."""
        if self.phase == "arming":
            return self._interrupt(f"Paused before {'it set out' if self._is_way else 'the take-off'}.")
        if self.phase == "flying":
            self.phase, self.hint, self._whereabouts.came_from = "paused", "", None
            if self._leading is not None:
                self._leading.stop()
            return self._stay_here(now_s)
        if self.phase == "taking_off":
            self.phase, self.hint = "paused", "It climbs to the height of the take-off first."
        return []

    def resume(self, now_s: float) -> list[Action]:
        if self.phase != "paused" or self.is_flown or self.ends_held:
            return []
        self.hint = ""
        if self._handover is None:
            self.phase = "taking_off"
            return []
        self.phase = "flying"
        return self._hand_over(now_s)

    def set_speed(self, speed_m_s: float, now_s: float) -> list[Action]:
        """On all that is left."""
        self._targets = tuple(replace(target, speed_m_s=speed_m_s) for target in self._targets)
        if self.phase != "flying":
            return []
        if self._leading is not None:
            self._leading.limit(self.left)
        return self._set_speed(speed_m_s, now_s)

    def stop(self, words: str) -> list[Action]:
        """Ends the script without a command: another one for the vehicle follows."""
        return [] if self.is_over else self._interrupt(words)

    # What each look at the vehicle's state leads to.

    def _look(self, state: VehicleState, now_s: float) -> list[Action]:
        if self.phase != "arming" and (words := self._watch.interruption(state)):
            landed = self.phase == "returning" and not state.armed
            return self._land() if landed else self._interrupt(words)
        if self.ends_held:
            return self._end_held(state, now_s)
        if self.phase in ("flying", "paused") and (words := self._home_watched.interruption(state)):
            if self._leading is not None:
                self._leading.stop()
            self.phase, self.hint, self.ends_held = "paused", words, words
            return self._stay_here(now_s)
        if self._home_shows_by_s is not None:
            return self._see_home(now_s)
        step = {"taking_off": self._climb, "flying": self._fly, "paused": self._hold, "returning": self._return}
        return step[self.phase](state, now_s) if self.phase in step else []

    def _climb(self, state: VehicleState, now_s: float) -> list[Action]:
        if not self._is_up(state, now_s):
            up = replace(self._whereabouts.here(self.target), alt_rel_home_m=self._takeoff_m)
            self._stands = self._standstill.words(state, up, "the height of the take-off", now_s)
            return []
        self.phase, self._stands = "flying", ""
        return self._hand_over(now_s)

    def _is_up(self, state: VehicleState, now_s: float) -> bool:
        height_m = state.alt_rel_home_m
        up = height_m is not None and height_m >= self._takeoff_m - TAKEOFF_TOLERANCE_M
        return up and not self._pending.is_under_way and is_fresh(state, now_s)

    def _fly(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._handover is not None
        if self._reached_s is None and self._has_arrived(state, now_s):
            self._reached_s, self.hint, self._whereabouts.came_from = now_s, "", self._handover.place
            self._punctuality.reached(self.target, now_s)
        if self._reached_s is None:
            self._punctuality.on_the_way(self.target, now_s)
            place = self._handover.place
            self._stands = self._standstill.words(state, place, f"item {self.target.item}", now_s)
            return self._lead(state, now_s) if self._leading else self._again_if_needed(state, now_s)
        self._stands = ""
        if now_s - self._reached_s < self.target.loiter_s or not is_fresh(state, now_s):
            return self._lead(state, now_s)
        self._index += 1
        progress = Progress("flying", self._index, len(self._targets))
        if not self.is_flown:
            return [progress, *self._hand_over(now_s)]
        if self.end == "hold":
            return [progress, *self._stay_there(now_s)]
        self.phase, self._handover = "returning", None
        return [progress, *self._go_home(now_s)]

    def _end_held(self, state: VehicleState, now_s: float) -> list[Action]:
        """Orders may be lost: it is over only once the vehicle has taken that it is to stay."""
        assert self._handover is not None
        held = self._handover.is_held(state, now_s)
        return self._interrupt(self.ends_held) if held else self._again_if_needed(state, now_s)

    def _stay_here(self, now_s: float) -> list[Action]:
        """Where the vehicle is by its last position, whose height above the sea no home moves."""
        here, radius_m = self._whereabouts.here(self.target), self._request.waypoint_radius_m
        self._handover = Handover(here, radius_m=radius_m, holds=True, stays=True)
        return self._send_place(now_s)

    def _stay_there(self, now_s: float) -> list[Action]:
        """Until another command comes: the script goes on watching that it does."""
        assert self._handover is not None
        self.phase, self.hint = "paused", THERE
        if self._leading is not None:
            self._leading.stop()
        return self._go_to(self._handover.place, now_s, holds=True)

    def _has_arrived(self, state: VehicleState, now_s: float) -> bool:
        assert self._handover is not None
        if self._leading is None:
            return self._handover.has_arrived(state, now_s)
        near_m = self._request.waypoint_radius_m + self._leading.early_m
        return self._leading.is_over and is_fresh(state, now_s) and away_m(state, self._handover.place) <= near_m

    def _hold(self, state: VehicleState, now_s: float) -> list[Action]:
        if self._handover is not None:
            return self._again_if_needed(state, now_s)
        return self._stay_here(now_s) if self._is_up(state, now_s) else []

    def _return(self, state: VehicleState, now_s: float) -> list[Action]:
        if not state.armed or (state.landed == "on_ground" and self._watch.seen):
            return self._land()
        again = not self._pending.is_under_way and not self._watch.seen and now_s >= self._return_at_s
        return self._go_home(now_s) if again else []

    def _land(self) -> list[Action]:
        self.phase, self.hint = "landed", ""
        return [Done(GuidedEnd(True, "All targets were flown, and the vehicle has landed."))]

    # What is sent.

    def _change_mode(self, mode: str, now_s: float, *, then: Then | None = None) -> list[Action]:
        message = self._orders.set_mode(mode)
        return self._pending.begin(message, now_s, confirm=lambda state: state.mode == mode, then=then)

    def _set_out(self, now_s: float) -> list[Action]:
        self.phase = "flying"
        return self._hand_over(now_s)

    def _arm(self, now_s: float) -> list[Action]:
        message = self._orders.arm()
        return self._pending.begin(message, now_s, once=True, confirm=lambda state: state.armed, then=self._see_home)

    def _see_home(self, now_s: float) -> list[Action]:
        """It has armed: home comes to where it stands, or an order has fixed it elsewhere."""
        self._home_shows_by_s = now_s + HOME_SHOWS_S if self._home_shows_by_s is None else self._home_shows_by_s
        refusal = home_elsewhere(self._state)
        if refusal is None:
            self._home_shows_by_s = None
            return self._take_off(now_s)
        if now_s < self._home_shows_by_s:
            return []
        return [Send(self._orders.disarm()), *self._fail(refusal)]

    def _take_off(self, now_s: float) -> list[Action]:
        self.phase = "taking_off"
        message = self._orders.take_off(self._takeoff_m, self._whereabouts.home_alt_amsl_m)
        return self._pending.begin(message, now_s, once=True, confirm=is_off_the_ground)

    def _hand_over(self, now_s: float) -> list[Action]:
        target, self._reached_s = self.target, None
        place = self._whereabouts.place(target, along_leg=self._orders.firmware == "ardupilot")
        # ArduPilot forgets the speed with the first place after a take-off or a hold: the place comes first.
        actions = self._go_to(place, now_s) if self._leading is None else self._begin_leg(place, now_s)
        return actions if target.speed_m_s == self._speed_m_s else [*actions, *self._set_speed(target.speed_m_s, now_s)]

    def _begin_leg(self, place: Place, now_s: float) -> list[Action]:
        assert self._leading is not None
        self._handover = Handover(place, radius_m=self._request.waypoint_radius_m)
        self._leading.go(self._whereabouts.start(self.target), self.left, now_s)
        return self._lead(self._state, now_s)

    def _lead(self, state: VehicleState, now_s: float) -> list[Action]:
        """Nothing while the vehicle's position is old: it stops by itself."""
        if self._leading is None or self._handover is None or not is_fresh(state, now_s):
            return []
        at = replace(self._whereabouts.here(self.target), heading_rad=state.heading_rad)
        found = self._leading.set_point(at, now_s, heading_rad=self._handover.place.heading_rad)
        return [] if found is None else [Send(self._orders.follow(found.place, found.v_neu_m_s))]

    def _set_speed(self, speed_m_s: float, now_s: float) -> list[Action]:
        self._speed_m_s = speed_m_s
        return self._pending.begin(self._orders.change_speed(speed_m_s), now_s)

    def _go_to(self, place: Place, now_s: float, *, holds: bool = False) -> list[Action]:
        self._handover = Handover(place, radius_m=self._request.waypoint_radius_m, holds=holds)
        return self._send_place(now_s)

    def _send_place(self, now_s: float) -> list[Action]:
        assert self._handover is not None
        self._handover.sent(self._state, now_s)
        return [Send(self._orders.go_to(self._handover.place, from_sea=self._handover.stays))]

    def _again_if_needed(self, state: VehicleState, now_s: float) -> list[Action]:
        assert self._handover is not None
        if self._handover.follow_home(self._whereabouts.home_alt_amsl_m) and self._orders.counts_from_sea:
            return self._send_place(now_s)
        if not self._handover.must_be_sent_again(state, now_s):
            return []
        if self._handover.sendings >= SLOW_TARGET_SENDINGS:
            does = "hold its position" if self.phase == "paused" else f"fly to item {self.target.item}"
            self.hint = f"The vehicle does not {does}, though it was told again and again."
        return self._send_place(now_s)

    def _go_home(self, now_s: float) -> list[Action]:
        mode = self._orders.end_mode("rtl" if self.end == "rtl" else "land")
        self._return_at_s = now_s + RETURN_AGAIN_S
        self._watch.expect(frozenset({mode, "LAND"}), before=self._orders.script_modes)
        return self._change_mode(mode, now_s)

    # How it ends.

    def _on_failed_command(self, error: TelemetryError, now_s: float) -> list[Action]:
        """On the ground it ends the script; in flight the vehicle is already under way and the script goes on."""
        if self.phase in ("arming", "taking_off") or (self.phase == "paused" and self._handover is None):
            return self._fail(error)
        self.hint = str(error)
        if isinstance(error, SilentError):
            self._speed_m_s = None  # sent again with the next target
        return []

    def _interrupt(self, words: str) -> list[Action]:
        self.broke_off_at = None if self.phase in ("arming", "returning") else self.target.item or None
        self.phase, self.hint = "interrupted", words
        return [Done(GuidedEnd(False, words))]

    def _fail(self, error: TelemetryError) -> list[Action]:
        self.phase, self.hint = "interrupted", str(error)
        return [Failed(error)]
