"""One place given to the vehicle: has it taken it, must it be sent again, is it there?"""

from __future__ import annotations

import math
from dataclasses import replace

from mapping.geometry.frames import apart_m
from telemetry.flight.guided.orders import Place
from telemetry.mavlink.actions import Message
from telemetry.topics.vehicle import VehicleState

SAME_PLACE_M = 1.0
"""Between a target and the one that the vehicle says it flies to."""
ANSWER_S = 0.7
"""A POSITION_TARGET_GLOBAL_INT that was on its way when the target was sent shows the old one."""
STUCK_S = 2.0
HOLD_AGAIN_S, HELD_M = 1.0, 2.0
"""A lost order to hold would let the vehicle fly on; the same place given twice does no harm."""
NEARER_M, MOVING_M_S = 0.3, 0.3
OLD_POSITION_S = 2.0
HOME_MOVED_M = 0.05
"""Less is noise of two heights that are told apart."""


def away_m(state: VehicleState, place: Place) -> float:
    """3-D distance; infinite where the vehicle's position is not known."""
    if state.lat_deg is None or state.lon_deg is None or state.alt_rel_home_m is None:
        return math.inf
    flat_m = apart_m((place.lat_deg, place.lon_deg), (state.lat_deg, state.lon_deg))
    return math.hypot(flat_m, state.alt_rel_home_m - place.alt_rel_home_m)


def is_fresh(state: VehicleState, now_s: float) -> bool:
    """Whether the position is of now."""
    return state.position_t_mono_s is not None and now_s - state.position_t_mono_s <= OLD_POSITION_S


class Handover:
    def __init__(self, place: Place, *, radius_m: float, holds: bool = False, stays: bool = False) -> None:
        """``holds``: the vehicle is to stay there; moving on is no sign that it has taken the place. ``stays``: at its
        height above the sea, wherever home goes: it is where the vehicle was."""
        self.place = place
        self._holds, self._stays = holds, stays
        self.sendings = 0
        self._radius_m = radius_m
        self._taken: bool | None = None
        self._sent_s = -math.inf
        self._away_when_sent_m = math.inf

    def follow_home(self, home_alt_amsl_m: float) -> bool:
        """Heights count from where home is now. True: it has moved, and the place with it: not one that is held."""
        shift_m = home_alt_amsl_m - self.place.home_alt_amsl_m
        if not abs(shift_m) > HOME_MOVED_M:
            return False
        if self._stays:
            up_m = self.place.alt_rel_home_m - shift_m
            self.place = replace(self.place, alt_rel_home_m=up_m, home_alt_amsl_m=home_alt_amsl_m)
            return False
        self.place = replace(self.place, home_alt_amsl_m=home_alt_amsl_m)
        self._taken = None
        return True

    def sent(self, state: VehicleState, now_s: float) -> None:
        self.sendings += 1
        self._sent_s, self._away_when_sent_m = now_s, away_m(state, self.place)

    def on_position_target(self, message: Message, now_s: float) -> None:
        """POSITION_TARGET_GLOBAL_INT of the vehicle, above mean sea level."""
        if now_s - self._sent_s < ANSWER_S and self._taken is None and not self._is_same(message):
            return
        self._taken = bool(self._taken) or self._is_same(message)

    def _is_same(self, message: Message) -> bool:
        told_deg = message.lat_int * 1e-7, message.lon_int * 1e-7
        flat_m = apart_m((self.place.lat_deg, self.place.lon_deg), told_deg)
        up_m = message.alt - self.place.home_alt_amsl_m - self.place.alt_rel_home_m
        return flat_m <= SAME_PLACE_M and not abs(up_m) > SAME_PLACE_M

    def must_be_sent_again(self, state: VehicleState, now_s: float) -> bool:
        """Not while the position is old: then the link is down, and what is sent now would come late."""
        if self._taken or not is_fresh(state, now_s):
            return False
        waited_s = now_s - self._sent_s
        if self._taken is False:
            return waited_s >= ANSWER_S
        return waited_s >= (HOLD_AGAIN_S if self._holds else STUCK_S) and not self._seems_to_go(state)

    def _seems_to_go(self, state: VehicleState) -> bool:
        left_m = away_m(state, self.place)
        if self._holds:
            return left_m <= max(self._radius_m, HELD_M)
        moving = (state.ground_speed_m_s or 0.0) > MOVING_M_S or abs(state.climb_m_s or 0.0) > MOVING_M_S
        return moving or left_m <= self._radius_m or left_m < self._away_when_sent_m - NEARER_M

    def is_held(self, state: VehicleState, now_s: float) -> bool:
        """The vehicle has taken the place, or stands there since."""
        if self._taken or not is_fresh(state, now_s):
            return bool(self._taken)
        stands = math.hypot(state.ground_speed_m_s or 0.0, state.climb_m_s or 0.0) <= MOVING_M_S
        return now_s - self._sent_s >= HOLD_AGAIN_S and stands and self._seems_to_go(state)

    @property
    def stays(self) -> bool:
        return self._stays

    def has_arrived(self, state: VehicleState, now_s: float) -> bool:
        return is_fresh(state, now_s) and away_m(state, self.place) <= self._radius_m
