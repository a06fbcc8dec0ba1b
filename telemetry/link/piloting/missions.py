"""The mission on board: started, gone on with in the middle, or joined at a later item.

A start arms the vehicle, reads the mission once more and sends it off before the motors are off again. A mission that
broke off is gone on with from a safe height: up, straight to its item, then into the mission.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Awaitable, Callable
from dataclasses import replace

from mapping.geometry.frames import apart_m
from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Firmware
from planning.formats.commands import FLOWN_TO
from telemetry.errors import MissionUnknownError, NotAllowedError, RefusedError, SilentError, TelemetryError
from telemetry.flight.guided.beginning import PLAN_AGAIN, why_moves
from telemetry.flight.guided.remaining_mission import RemainingMission, remaining_from
from telemetry.link.adopted import AdoptedVehicle
from telemetry.link.onboard import OnBoard, check_same_mission
from telemetry.link.piloting.procedures import ReadParameters, see_home_here
from telemetry.mavlink.autopilot_orders import HOLD_MODES
from telemetry.mavlink.believing import is_in_the_air
from telemetry.mavlink.flight_keeper import sequence_of
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.requests import StartAuto
from telemetry.topics.vehicle import VehicleState

RESTART_PARAMETER = "MIS_RESTART"
ARMED_WITHIN_S = 10.0
ReadMission = Callable[[], Awaitable[OnboardMission]]
AGAIN_S = 8.0
"""A vehicle on the ground switches its motors off 10 s after it has armed."""
GROUND, AIR = 1, 0
"""SPEED_TYPE; a multirotor takes them for the same."""
NEAR_M = 1.0
HEIGHT_TOLERANCE_M = 0.5
SLOWEST_CLIMB_M_S, SLOWEST_FLIGHT_M_S = 0.3, 0.5
CAREFUL_M_S = 2.0
"""To a place from which on no speed is known."""
PATIENCE_S = 30.0
MODE_SHOWS_S = 5.0
GUIDED = "GUIDED"
FIRST = 1


async def start_mission(vehicle: AdoptedVehicle, digest: str, read_mission: ReadMission) -> None:
    """ArduPilot does not arm in AUTO; PX4 takes off as soon as it is armed in its mission mode.

    Raises RefusedError, SilentError, and MissionUnknownError where another mission is on board now. A vehicle that has
    switched its motors off meanwhile is not armed a second time: it may have been a pilot who did that.
    """
    orders = vehicle.orders
    first, at = sequence_of(1, vehicle.state.autopilot), vehicle.state.mission_item
    if at is None or at > first:  # not known: it may be where an earlier flight broke off
        await vehicle.obey(orders.mission_item(first))
    if vehicle.firmware == "ardupilot":
        await vehicle.obey(orders.mode("GUIDED"))
        await _arm(vehicle)
        await _or_disarm(vehicle, check_again(vehicle.onboard, digest, read_mission))
        await _or_disarm(vehicle, see_home_here(vehicle))
        await _send_off(vehicle)
    else:
        await vehicle.obey(orders.mission_mode())
        await check_again(vehicle.onboard, digest, read_mission)
        await see_home_here(vehicle)
        await _arm(vehicle)
        await vehicle.obey(orders.start_mission())
        await _see_armed(vehicle)


async def check_not_begun_anew(firmware: Firmware, read_parameters: ReadParameters) -> None:
    """Raises NotAllowedError for an ArduPilot that would begin its mission again instead of going on with it."""
    if firmware != "ardupilot":
        return
    if (await read_parameters((RESTART_PARAMETER,)))[RESTART_PARAMETER]:
        what = f"The vehicle would begin its mission again: its parameter {RESTART_PARAMETER} is not 0."
        advice = f"Return home, set {RESTART_PARAMETER} to 0, and start where the flight broke off."
        raise NotAllowedError(what, advice=advice)


async def _send_off(vehicle: AdoptedVehicle) -> None:
    """It was armed: where it is not any more, that is why."""
    try:
        await vehicle.obey(vehicle.orders.mission_mode())
        await vehicle.obey(vehicle.orders.start_mission())
        await _see_armed(vehicle)
    except (RefusedError, SilentError):
        if vehicle.state.armed:
            raise
        raise SilentError(
            "The vehicle's motors are off again, before it took off.",
            advice="ArduPilot does so DISARM_DELAY after arming, usually 10 s. If nobody else did it, too much is lost"
            " on the link: improve it, then start again.",
        ) from None


async def _see_armed(vehicle: AdoptedVehicle) -> None:
    await vehicle.wait_until(lambda state: state.armed, timeout_s=ARMED_WITHIN_S, what="arm")


async def _or_disarm(vehicle: AdoptedVehicle, check: Awaitable[None]) -> None:
    try:
        await check
    except TelemetryError:
        with contextlib.suppress(TelemetryError):  # it switches its motors off by itself soon
            await vehicle.obey(vehicle.orders.disarm())
        raise


async def _arm(vehicle: AdoptedVehicle) -> None:
    if not vehicle.state.armed:
        await vehicle.obey(vehicle.orders.arm())


async def check_again(onboard: OnBoard, digest: str, read_mission: ReadMission) -> None:
    """The same, of a mission that is read back now: another station may have replaced it a moment ago.

    Raises MissionUnknownError.
    """
    check_same_mission(onboard, digest)
    try:
        async with asyncio.timeout(AGAIN_S):
            await read_mission()
    except (TelemetryError, TimeoutError) as error:
        raise MissionUnknownError(
            f"The mission on board could not be read once more before the start: {str(error) or 'it took too long'}.",
            advice="Improve the link, then start again.",
        ) from None
    check_same_mission(onboard, digest)


def check_may_start(onboard: OnBoard, request: StartAuto) -> None:
    """Raises MissionUnknownError, or NotAllowedError for an item that the mission on board does not have."""
    if onboard.state != "verified":
        what = "What is on board is not known." if onboard.state == "unknown" else "There is no mission on board."
        raise MissionUnknownError(what, advice="Upload the plan, or read the mission back.")
    if onboard.digest != request.digest:
        what = "The mission on board is another one than the one that was checked."
        raise MissionUnknownError(what, advice="Upload the plan again.")
    items = onboard.mission.items if onboard.mission else ()
    if not 1 <= request.from_item <= len(items):
        what = f"The mission on board has {len(items)} items: there is no item {request.from_item}."
        raise NotAllowedError(what, advice="Start it at an item that it has.")


def check_holds(state: VehicleState, *, led: str) -> None:
    """Before what is on board is replaced in flight. ``led``: how something here still leads the vehicle, or nothing.

    Raises NotAllowedError.
    """
    if not (state.armed and is_in_the_air(state)):
        raise NotAllowedError("The vehicle is not in the air.", advice="Upload the plan and check it.")
    if led or state.mode not in HOLD_MODES.get(state.autopilot, ()):
        what = f"The vehicle does not hold: it is {led or f'in {state.mode}'}."
        raise NotAllowedError(what, advice="Hold first: what is on board is replaced only then.")
    if (refusal := why_moves(state, again=PLAN_AGAIN)) is not None:
        raise refusal


async def first_item_next(vehicle: AdoptedVehicle) -> None:
    """Until the vehicle's state shows it. Raises RefusedError, SilentError."""
    sequence = sequence_of(FIRST, vehicle.state.autopilot)
    await vehicle.obey(vehicle.orders.mission_item(sequence))
    await vehicle.wait_until(
        lambda state: state.mission_item == sequence, timeout_s=MODE_SHOWS_S, what="go to the mission's first item"
    )


def same_route(one: OnboardMission, other: OnboardMission) -> bool:
    """Other heights are no other route."""
    return [(i.command, i.lat_deg, i.lon_deg) for i in one.items] == [
        (i.command, i.lat_deg, i.lon_deg) for i in other.items
    ]


async def set_speeds(vehicle: AdoptedVehicle, item: int) -> None:
    """The speeds that hold at this item. ArduPilot forgets them whenever its flight mode changes.

    Raises RefusedError, SilentError: the vehicle then flies on at the speed of its own settings.
    """
    for kind, speed_m_s in speeds_before(vehicle.onboard.mission, item).items():
        await vehicle.obey(vehicle.orders.change_speed(kind, speed_m_s))


def speeds_before(mission: OnboardMission | None, item: int) -> dict[int, float]:
    """Of each SPEED_TYPE the speed in m/s that the items before this one (1 is the first) have set last."""
    speeds: dict[int, float] = {}
    for before in mission.items[: item - 1] if mission else ():
        if (found := _speed(before)) is not None:
            kind, speed_m_s = found
            speeds[kind] = speed_m_s
    return speeds


def _speed(item: Item) -> tuple[int, float] | None:
    kind, speed_m_s = item.params[:2]
    if item.command != MavCmd.DO_CHANGE_SPEED or kind is None or speed_m_s is None or not speed_m_s > 0:
        return None
    return (GROUND if kind == AIR else int(kind)), speed_m_s


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
        self._is_up = False

    @property
    def remaining(self) -> RemainingMission | None:
        """The way there and what follows; None during the take-off. Where no script can fly that, it holds there."""
        onboard, place = self._vehicle.onboard.mission, self._place
        if not self._is_up or onboard is None:
            return None
        rest = remaining_from(onboard, self._item) or RemainingMission((), "hold")
        speed_m_s = rest.targets[0].speed_m_s if rest.targets else CAREFUL_M_S
        there = GuidedTarget(self._item, place.lat_deg, place.lon_deg, self._climb_to_m, speed_m_s)
        return replace(rest, targets=(there, *rest.targets))

    async def take_off(self) -> None:
        vehicle, orders = self._vehicle, self._vehicle.orders
        self.is_active = True
        try:
            await vehicle.obey(orders.mode(GUIDED))
            if not vehicle.state.armed:
                await vehicle.obey(orders.arm())
            await _or_disarm(vehicle, see_home_here(vehicle))
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
        away_m, self._is_up = _away_m(vehicle.state, place), True
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
    return apart_m((state.lat_deg, state.lon_deg), (place.lat_deg, place.lon_deg))
