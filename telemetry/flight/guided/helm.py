"""Steers a multirotor in flight: stop, take over, go to a place. One order at a time, sans-IO.

ArduPilot goes to places in GUIDED and stops in BRAKE; PX4 does both in HOLD.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from mapping.geometry.frames import moved_deg
from planning.basics.plan_model import Firmware
from telemetry.errors import RefusedError, TelemetryError
from telemetry.flight.guided.handover import Handover, is_fresh
from telemetry.flight.guided.orders import GROUND_SPEED, GuidedOrders, Place
from telemetry.flight.guided.pending_command import PendingCommand, Then
from telemetry.mavlink.actions import Action, Message, Send
from telemetry.mavlink.commands import ACCEPTED, UNSUPPORTED
from telemetry.mavlink.conversation import GROUND_STATION, Endpoints
from telemetry.topics.vehicle import VehicleState

STANDS_M_S = 0.4
MODE_SHOWS_S = 3.0
FALLBACK_DECEL_M_S2 = 1.5
PAUSED = frozenset({ACCEPTED, UNSUPPORTED})
"""PX4's commander does not know a change of place that changes no mode; its navigator carries it out."""


class Helm:
    """``asked``: told of every mode that is commanded. ``failed``: why the last order was not obeyed, or empty."""

    def __init__(
        self,
        target: tuple[int, int],
        asked: Callable[[str, float], None],
        *,
        firmware: Firmware = "ardupilot",
        own: tuple[int, int] = GROUND_STATION,
    ) -> None:
        self._endpoints, self.orders = Endpoints(target, own), GuidedOrders(firmware, target)
        self._asked = asked
        self._pending = PendingCommand(self._endpoints, self._on_failed)
        self._mode, self._mode_s = "", 0.0
        """Commanded last and not given up, and when."""
        self._handover: Handover | None = None
        self._state: VehicleState | None = None
        self._speed: tuple[float, float] | None = None
        self._is_placed = False
        """A place was sent in this mode."""
        self._stops = False
        """It was ordered to, and nothing else since."""
        self.failed = ""
        self.most_m_s = math.inf
        """Over ground, whatever is asked for."""

    @property
    def guided_mode(self) -> str:
        """In which it goes where it is sent."""
        return self.orders.guided_mode

    @property
    def place(self) -> Place | None:
        """Where it was sent last."""
        return None if self._handover is None else self._handover.place

    def let_go(self) -> None:
        """Nothing more is sent."""
        self._pending = PendingCommand(self._endpoints, self._on_failed)
        self._handover, self._mode, self._speed, self.failed = None, "", None, ""
        self._is_placed = self._stops = False

    # What comes in.

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if not self._endpoints.is_from_vehicle(message):
            return []
        if message.get_type() == "POSITION_TARGET_GLOBAL_INT" and self._handover is not None:
            self._handover.on_position_target(message, now_s)
        return self._pending.on_message(message, now_s)

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        self._state = state
        return [*self._pending.on_state(state, now_s), *self._again_if_needed(now_s)]

    def on_tick(self, now_s: float) -> list[Action]:
        return [*self._pending.on_tick(now_s), *self._mode_again_if_needed(now_s), *self._again_if_needed(now_s)]

    # Orders.

    def stop(self, now_s: float) -> list[Action]:
        """Brakes and holds."""
        self._handover, self.failed = None, ""
        mode, again = self.orders.stop_modes[0], self._stops
        self._stops = True
        if not self.orders.holds_where_it_is_guided:
            return self.change_mode(mode, now_s)
        shows = self._state is not None and self._state.mode == mode
        if shows and self._mode in ("", mode):
            self._mode = mode
            return [] if again else self._pause(now_s)
        if again and self._mode == mode and self._pending.is_under_way:
            return []
        # It may fly to a place in that mode already, which the mode alone does not end.
        then = self._pause if shows or self._mode else None
        self._mode = mode
        return self._command_mode(now_s, then)

    def _pause(self, now_s: float) -> list[Action]:
        return self._pending.begin(self.orders.pause(), now_s, taken=PAUSED)

    def stop_in_guided(self, state: VehicleState, now_s: float, *, radius_m: float = 1.0) -> list[Action]:
        """The same without leaving the mode: ArduPilot is sent to where it can stand still."""
        if self.orders.holds_where_it_is_guided:
            return self.stop(now_s)
        return self.go_to(stopping_place(state), now_s, radius_m=radius_m, holds=True)

    def change_mode(self, mode: str, now_s: float, *, then: Then | None = None) -> list[Action]:
        """Nothing when it has been commanded already."""
        if self._mode == mode:
            return []
        self._mode, self._stops = mode, self._stops and mode == self.orders.stop_modes[0]
        return self._command_mode(now_s, then)

    def _command_mode(self, now_s: float, then: Then | None = None) -> list[Action]:
        mode, self._mode_s = self._mode, now_s
        self._speed, self._is_placed = None, False  # a speed is forgotten with a change of mode
        self._asked(mode, now_s)
        message = self.orders.set_mode(mode)
        return self._pending.begin(message, now_s, confirm=lambda state: state.mode == mode, then=then)

    def go_to(self, place: Place, now_s: float, *, radius_m: float, holds: bool = False) -> list[Action]:
        """In the mode for it."""
        self._stops = False
        self._handover = Handover(place, radius_m=radius_m, holds=holds)
        return self._send_place(now_s)

    def set_speed(self, speed_m_s: float, now_s: float, kind: float = GROUND_SPEED) -> list[Action]:
        """Once per speed; ``kind``: SPEED_TYPE. ArduCopter forgets a speed from before its first place in GUIDED, so
        it is ordered after that."""
        if kind == GROUND_SPEED:
            speed_m_s = min(speed_m_s, self.most_m_s)
        if self._speed == (kind, speed_m_s):
            return []
        self._speed = (kind, speed_m_s)
        return [] if self._mode == self.guided_mode and not self._is_placed else self._order_speed(now_s)

    def _order_speed(self, now_s: float) -> list[Action]:
        assert self._speed is not None
        kind, speed_m_s = self._speed
        return self._pending.begin(self.orders.change_speed(speed_m_s, kind), now_s)

    def slow_down(self, speed_m_s: float, now_s: float) -> list[Action]:
        """As often as it is asked: a mission's own items change it back. Waits while another order is under way."""
        if self._pending.is_under_way:
            return []
        self._speed = None
        return self.set_speed(speed_m_s, now_s)

    # What the vehicle's state shows.

    def has_stopped(self, state: VehicleState, now_s: float) -> bool:
        """In the mode that was commanded for it: one that was standing in GUIDED already is not stopped before BRAKE
        shows, or whatever is ordered next would be undone by it. Where no mode shows it, the order must be answered."""
        speed_m_s = math.hypot(state.ground_speed_m_s or 0.0, state.climb_m_s or 0.0)
        shows = state.mode in self.orders.stop_modes and self._mode in ("", state.mode)
        waits = self.orders.holds_where_it_is_guided and self._stops and self._pending.is_under_way
        return shows and not waits and is_fresh(state, now_s) and speed_m_s <= STANDS_M_S

    def has_arrived(self, state: VehicleState, now_s: float) -> bool:
        return self._handover is not None and self._handover.has_arrived(state, now_s)

    def _mode_again_if_needed(self, now_s: float) -> list[Action]:
        """An acknowledgement does not say of which mode it is: what does not show is commanded again."""
        shows = self._state is None or not self._mode or self._state.mode == self._mode
        waits = self._pending.is_under_way or now_s - self._mode_s < MODE_SHOWS_S
        return [] if shows or waits else self._command_mode(now_s)

    def _again_if_needed(self, now_s: float) -> list[Action]:
        if self._handover is None or self._state is None or self._state.mode != self.guided_mode:
            return []
        return self._send_place(now_s) if self._handover.must_be_sent_again(self._state, now_s) else []

    def _send_place(self, now_s: float) -> list[Action]:
        assert self._handover is not None
        assert self._state is not None
        self._handover.sent(self._state, now_s)
        speed = [] if self._is_placed or self._speed is None else self._order_speed(now_s)
        self._is_placed = True
        # A pilot's mode that has not shown yet is not undone by it.
        return [Send(self.orders.go_to(self._handover.place, changes_mode=False)), *speed]

    def _on_failed(self, error: TelemetryError, now_s: float) -> list[Action]:
        mode, self._mode, self._speed, self._stops = self._mode, "", None, False
        if mode == "BRAKE" and isinstance(error, RefusedError):
            return self._stop_without_brake(now_s)
        self.failed = str(error)
        return []

    def _stop_without_brake(self, now_s: float) -> list[Action]:
        """For a vehicle without BRAKE."""
        if self._state is not None and self._state.mode == self.guided_mode:
            return self.stop_in_guided(self._state, now_s)
        return self.change_mode(self.guided_mode, now_s)


def stopping_place(state: VehicleState) -> Place:
    """Ahead of the vehicle, where it can stand still."""
    here = here_of(state)
    speed_m_s = state.ground_speed_m_s or 0.0
    seconds = speed_m_s / (2 * FALLBACK_DECEL_M_S2)
    north_m, east_m = (state.v_north_m_s or 0.0) * seconds, (state.v_east_m_s or 0.0) * seconds
    return moved(here, north_m, east_m, 0.0)


def here_of(state: VehicleState) -> Place:
    """Where the vehicle is, its nose where it is. Only for a state with a position."""
    assert state.lat_deg is not None
    assert state.lon_deg is not None
    assert state.alt_rel_home_m is not None
    home_alt_m = math.nan if state.alt_amsl_m is None else state.alt_amsl_m - state.alt_rel_home_m
    return Place(state.lat_deg, state.lon_deg, state.alt_rel_home_m, home_alt_m, state.heading_rad)


def from_the_same_home(state: VehicleState, before: VehicleState) -> VehicleState:
    """Its height counted from where home was: who moves home meanwhile changes no height that is told above the sea."""
    alt_amsl_m, before_amsl_m, before_rel_m = state.alt_amsl_m, before.alt_amsl_m, before.alt_rel_home_m
    if alt_amsl_m is None or before_amsl_m is None or before_rel_m is None:
        return state
    return replace(state, alt_rel_home_m=alt_amsl_m - (before_amsl_m - before_rel_m))


def moved(place: Place, north_m: float, east_m: float, up_m: float) -> Place:
    lat_deg, lon_deg = moved_deg((place.lat_deg, place.lon_deg), east_m, north_m)
    return replace(place, lat_deg=lat_deg, lon_deg=lon_deg, alt_rel_home_m=place.alt_rel_home_m + up_m)
