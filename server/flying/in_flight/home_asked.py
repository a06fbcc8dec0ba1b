"""A home that was judged and may be set: what it was judged by, and why it may not be set any more."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from mapping.geometry.frames import apart_m
from server.errors import CheckNeededError
from server.flying.in_flight.home_task import Led
from server.flying.in_flight.way_desk import WayDesk
from server.obstacles.surroundings import returns_from
from server.scene.mirror import Voxels
from server.schemas import HomeAskedDoc, ReturnDoc
from server.schemas.flight_docs import CHECK_FRESH_S
from telemetry.flight.guided.beginning import why_moves
from telemetry.flight.home_watch import home_of, is_there
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.vehicle import VehicleState

MOVED_M = 2.0
"""A vehicle that was moved further is not "here" any more."""
AGAIN = "Ask for home again."


@dataclass(frozen=True, slots=True)
class AskedHome:
    doc: HomeAskedDoc
    judged_mono_s: float
    state: VehicleState
    """From which it was judged."""
    maps: tuple[Voxels, ...]
    """What sensors had seen of which the return to it keeps clear."""
    led: Led

    def check_still(self, now: VehicleState | None) -> None:
        """Raises CheckNeededError where that is long ago, or home, or for "here" the vehicle, is elsewhere by now."""
        if time.monotonic() - self.judged_mono_s > CHECK_FRESH_S:
            raise CheckNeededError(f"That home was judged more than {CHECK_FRESH_S:.0f} s ago.", advice=AGAIN)
        if now is None:
            raise CheckNeededError("The vehicle is not heard.", advice="Connect it, then ask for home again.")
        home = home_of(self.state)
        if home is None or not is_there(home_of(now), home):
            raise CheckNeededError("Home was moved since that was judged.", advice=AGAIN)
        if is_in_the_air(now) is not (self.doc.ret is not None):
            does = "taken off" if is_in_the_air(now) else "landed"
            raise CheckNeededError(f"The vehicle has {does} since that was judged.", advice=AGAIN)
        if self.doc.is_here and not _is_beside(self.state, now):
            raise CheckNeededError("The vehicle has moved since that was judged.", advice=AGAIN)

    async def check_seen(self, now: VehicleState | None, ways: WayDesk) -> None:
        """Raises CheckNeededError where more was seen near a way to that home or to a rally point that was said to be
        certified, from where the vehicle was or is; NotReadyError where nobody knows. Guided ways are not flown then,
        either."""
        if now is None or self.doc.ret is None:
            return
        line_deg = looked_along(self.doc.ret, self.led, (self.doc.lat_deg, self.doc.lon_deg), (self.state, now))
        if line_deg and await ways.has_seen_more_near(self.maps, line_deg, self.led.required_m):
            what = "Sensors have seen more near the return to that home since it was judged."
            # Who flies on sees more all the while.
            raise CheckNeededError(what, advice=AGAIN if why_moves(now) is None else "Hold, then ask for home again.")


def looked_along(
    ret: ReturnDoc, led: Led, home_deg: tuple[float, float], states: Sequence[VehicleState]
) -> list[tuple[float, float]]:
    """(lat_deg, lon_deg) along what was said to be certified, from where the vehicle was; empty where nothing was."""
    if not (ret.state == "certified" or ret.instead):
        return []
    places = [place for place in map(_place, states) if place is not None]
    if ret.instead:  # a guided way promises no other return
        return [*reversed(places), *led.instead_deg]
    return returns_from(places, (home_deg, *led.rally_deg), led.required_m)


def _place(state: VehicleState) -> tuple[float, float] | None:
    if state.lat_deg is None or state.lon_deg is None:
        return None
    return state.lat_deg, state.lon_deg


def _is_beside(before: VehicleState, now: VehicleState) -> bool:
    was, here = _place(before), _place(now)
    return was is not None and here is not None and apart_m(was, here) <= MOVED_M
