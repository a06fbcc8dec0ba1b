"""Going on with a mission that broke off: up, straight to its item at a safe height, then into the mission."""

from __future__ import annotations

import math
from collections.abc import Callable

from planning.formats.commands import FLOWN_TO
from telemetry.errors import NotAllowedError
from telemetry.mavlink.adopted import AdoptedVehicle
from telemetry.mavlink.flight_keeper import sequence_of
from telemetry.mavlink.going_on import ReadMission, check_again, set_speeds
from telemetry.messages import Item
from telemetry.requests import StartAuto
from telemetry.vehicle import VehicleState

NEAR_M = 1.0
HEIGHT_TOLERANCE_M = 0.5
SLOWEST_CLIMB_M_S, SLOWEST_FLIGHT_M_S = 0.3, 0.5
PATIENCE_S = 30.0
MODE_SHOWS_S = 5.0
GUIDED = "GUIDED"
METRES_PER_DEG = 111_195.0


class JoinMission:
    """``take_off``, then ``go_on``, which may be called again after a pause."""

    def __init__(self, vehicle: AdoptedVehicle, request: StartAuto, read_mission: ReadMission) -> None:
        """Raises NotAllowedError when there is no safe way for it."""
        if vehicle.state.autopilot != "ardupilot":
            what = "Going on at a later item works with ArduPilot only."
            raise NotAllowedError(what, advice="Plan the rest of the route as a mission of its own.")
        if request.climb_to_m is None or not request.climb_to_m > 0:
            what = f"To go on at item {request.from_item} a height for the way there is needed."
            raise NotAllowedError(what, advice="Let the height be worked out from the surface model.")
        self._vehicle, self._item, self._digest = vehicle, request.from_item, request.digest
        self._read_mission = read_mission
        self._climb_to_m = request.climb_to_m
        self._place = self._find_place()
        self.is_active = self.is_done = False

    async def take_off(self) -> None:
        vehicle, orders = self._vehicle, self._vehicle.orders
        self.is_active = True
        try:
            await vehicle.obey(orders.mode(GUIDED))
            if not vehicle.state.armed:
                await vehicle.obey(orders.arm())
            await vehicle.obey(orders.take_off(self._climb_to_m))
        except BaseException:
            self.is_active = False
            raise

    async def go_on(self, accepted: Callable[[], None]) -> None:
        self.is_active = True
        try:
            accepted()
            await self._fly_there()
            vehicle = self._vehicle
            await check_again(vehicle.onboard, self._digest, self._read_mission)
            await vehicle.obey(vehicle.orders.mission_item(sequence_of(self._item, vehicle.state.autopilot)))
            await vehicle.obey(vehicle.orders.mission_mode())
            self.is_done = True
            await set_speeds(vehicle, self._item)
        finally:
            self.is_active = False

    async def _fly_there(self) -> None:
        """Up first: only at that height is the way known to be clear."""
        vehicle, place = self._vehicle, self._place
        height_m = self._climb_to_m
        if vehicle.state.mode != GUIDED:
            await vehicle.obey(vehicle.orders.mode(GUIDED))
            await vehicle.wait_until(
                lambda state: state.mode == GUIDED, timeout_s=MODE_SHOWS_S, what="change to GUIDED"
            )
        await self._wait(lambda state: _climbed(state, height_m), height_m / SLOWEST_CLIMB_M_S, "climb")
        away_m = _away_m(vehicle.state, place)
        await vehicle.obey(vehicle.orders.go_to(place.lat_deg, place.lon_deg, height_m))
        at_place = f"reach the place of item {self._item}"
        await self._wait(lambda state: _away_m(state, place) < NEAR_M, away_m / SLOWEST_FLIGHT_M_S, at_place)

    async def _wait(self, arrived: Callable[[VehicleState], bool], seconds: float, what: str) -> None:
        vehicle = self._vehicle
        over: Callable[[VehicleState], bool] = lambda state: arrived(state) or state.mode != GUIDED  # noqa: E731
        await vehicle.wait_until(over, timeout_s=PATIENCE_S + min(seconds, 1800.0), what=what)
        if vehicle.state.mode != GUIDED:
            what = f"The flight mode was changed to {vehicle.state.mode} on the way to item {self._item}."
            raise NotAllowedError(what, advice="Resume to go on, or return home.")

    def _find_place(self) -> Item:
        """Of the first item from there on that is flown to."""
        onboard = self._vehicle.onboard.mission
        items = onboard.items[self._item - 1 :] if onboard else ()
        place = next((item for item in items if _is_place(item)), None)
        if place is None:
            what = f"From item {self._item} on the mission leads nowhere."
            raise NotAllowedError(what, advice="Start it at a waypoint.")
        return place


def _is_place(item: Item) -> bool:
    return item.command in FLOWN_TO and bool(item.lat_deg or item.lon_deg)


def _climbed(state: VehicleState, height_m: float) -> bool:
    return state.alt_rel_home_m is not None and state.alt_rel_home_m > height_m - HEIGHT_TOLERANCE_M


def _away_m(state: VehicleState, place: Item) -> float:
    if state.lat_deg is None or state.lon_deg is None:
        return math.inf
    north_m = (place.lat_deg - state.lat_deg) * METRES_PER_DEG
    east_m = (place.lon_deg - state.lon_deg) * METRES_PER_DEG * math.cos(math.radians(state.lat_deg))
    return math.hypot(north_m, east_m)
