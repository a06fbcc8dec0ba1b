"""Home that moves in flight: set by the transmitter, another station or a command. The ways home were proven for the
home of the take-off, and what counts its heights from home flies higher or lower with it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mapping.geometry.frames import apart_m, offset_m
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.vehicle import HomePlace as HomePlace
from telemetry.topics.vehicle import VehicleState

MOVED_M, ROSE_M = 1.0, 0.5
"""Less is what receivers and barometers wander, and autopilots follow."""
CORRECTED_M = 2.0
"""Up to here PX4 may correct home's height in flight, by its receiver: 1.2 m were measured."""
UNSEEN_M = 0.3
"""What receivers wander, whatever a way has to spare."""
EIGHTHS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
WHAT_TO_DO = (
    "The ways home are certified for the home before. Hold, then certify the rest from here (Fly, On board),"
    " or set home back; do not rely on Return until then."
)


def home_of(state: VehicleState) -> HomePlace | None:
    lat_deg, lon_deg, alt_m = state.home_lat_deg, state.home_lon_deg, state.home_alt_amsl_m
    return None if lat_deg is None or lon_deg is None or alt_m is None else HomePlace(lat_deg, lon_deg, alt_m)


def home_of_takeoff(states: Sequence[VehicleState]) -> HomePlace | None:
    """Home as the vehicle told it first in the air: before that it may be the one of an earlier flight.

    None where the states of the flight begin in the air already: it may have been moved before.
    """
    if not states or is_in_the_air(states[0]):
        return None
    flown = (state for state in states if is_in_the_air(state))
    return next((home for state in flown if (home := home_of(state)) is not None), None)


def is_there(home: HomePlace | None, wanted: HomePlace) -> bool:
    """Within what home wanders by itself."""
    return home is not None and moved_words(wanted, home) is None


def is_within(home: HomePlace, certified: HomePlace, up_m: float) -> bool:
    """What counts its heights from ``certified`` may be flown: home lies there, and no more than ``up_m`` off in
    height."""
    away_m = apart_m((certified.lat_deg, certified.lon_deg), (home.lat_deg, home.lon_deg))
    return away_m <= MOVED_M and abs(home.alt_amsl_m - certified.alt_amsl_m) <= up_m


def spare_up_m(spare_m: float | None) -> float:
    """By how much home's height may be another one for a way that has so much clearance to spare; None: not known."""
    return math.inf if spare_m is None else max(UNSEEN_M, spare_m)


def follows_m(state: VehicleState) -> float:
    """By how much the autopilot may correct home's height in flight."""
    return CORRECTED_M if state.autopilot == "px4" else ROSE_M


class HomeWatch:
    """Of one flight after the other."""

    def __init__(self) -> None:
        self._home: HomePlace | None = None
        self._certified: HomePlace | None = None
        """Home that the flight began with, or that was ordered since."""
        self._ordered: HomePlace | None = None
        self._follows_m = ROSE_M

    @property
    def is_elsewhere(self) -> bool:
        """Farther away than the autopilot itself corrects it."""
        home, before = self._home, self._certified
        return home is not None and before is not None and not is_within(home, before, self._follows_m)

    def expect(self, ordered: HomePlace | None) -> None:
        """Home that comes there moves by our own order; None: nothing is ordered."""
        self._ordered = ordered

    def on_state(self, state: VehicleState) -> str | None:
        """What is to be said at once, each time that home has moved since it was last said."""
        if not (state.armed and is_in_the_air(state)):
            self._home = self._certified = None
            return None
        home = home_of(state)
        if home is None or self._home is None:
            self._home = self._certified = home or self._home
            return None
        self._follows_m = follows_m(state)
        if self._ordered is not None and is_there(home, self._ordered):
            self._home = self._certified = home
            return None
        words = moved_words(self._home, home)
        if words is not None:
            self._home = home
        return words


def moved_words(before: HomePlace, now: HomePlace) -> str | None:
    """None where it has not moved by more than it wanders."""
    east_m, north_m = offset_m((before.lat_deg, before.lon_deg), now.lat_deg, now.lon_deg)
    away_m, rose_m = math.hypot(east_m, north_m), now.alt_amsl_m - before.alt_amsl_m
    if away_m <= MOVED_M and abs(rose_m) <= ROSE_M:
        return None
    parts = []
    if away_m > MOVED_M:
        parts.append(f"{away_m:.0f} m to the {EIGHTHS[round(math.atan2(east_m, north_m) / (math.pi / 4)) % 8]}")
    if abs(rose_m) > ROSE_M:
        parts.append(f"{abs(rose_m):.1f} m {'up' if rose_m > 0 else 'down'}")
    return f"Home has moved in flight: {' and '.join(parts)}. {WHAT_TO_DO}"
