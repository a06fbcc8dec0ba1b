"""What is left of a flight, as targets that can be handed over one at a time at another height."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from mapping.geometry.frames import apart_m
from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Firmware, Home, Mission, MissionItem
from planning.certificate.commands import TAKEOFFS
from planning.errors import MissionError
from telemetry.flight.guided.orders import RETURNS
from telemetry.flight.guided.script_targets import guided_plan
from telemetry.mavlink.autopilot_orders import MISSION_MODES
from telemetry.mavlink.flight_keeper import item_of
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.vehicle import VehicleState

LANDS_M = 20.0
"""From home; nearer than that the way home is a descent, where whatever stands around is not in the way."""


@dataclass(frozen=True, slots=True)
class RemainingMission:
    targets: tuple[GuidedTarget, ...]
    end: Literal["rtl", "land", "hold"]
    """What follows the last target."""
    way: Literal["auto", "guided"] = "auto"

    def raised(self, by_m: float) -> RemainingMission:
        """The same, higher."""
        higher = tuple(replace(t, alt_rel_home_m=t.alt_rel_home_m + by_m) for t in self.targets)
        return replace(self, targets=higher)


def remaining_flight(onboard: OnboardMission | None, state: VehicleState) -> RemainingMission | None:
    """Of a mission on board that is flown, or of a return; None: nothing that could be gone on with."""
    if state.mode in RETURNS:
        return RemainingMission((), "rtl") if _is_away(state) else None
    flies_it = state.mode == MISSION_MODES.get(state.autopilot)
    return remaining_mission(onboard, state) if onboard is not None and flies_it else None


def remaining_mission(onboard: OnboardMission, state: VehicleState) -> RemainingMission | None:
    """From the item that is flown to now. None during the take-off and the landing, and for what no script can fly."""
    number = item_of(state)
    if number is None or not 1 <= number <= len(onboard.items):
        return None
    command = onboard.items[number - 1].command
    if command in TAKEOFFS or command == MavCmd.NAV_LAND:
        return None
    firmware: Firmware = "px4" if state.autopilot == "px4" else "ardupilot"
    remaining = remaining_from(onboard, number, firmware)
    return None if remaining is None or (not remaining.targets and not _is_away(state)) else remaining


def remaining_from(onboard: OnboardMission, number: int, firmware: Firmware = "ardupilot") -> RemainingMission | None:
    """From an item on, 1 is the first. None for items that no script can fly, and for one that is not on board."""
    if not 1 <= number <= len(onboard.items):
        return None
    if all(item.command == MavCmd.NAV_RETURN_TO_LAUNCH for item in onboard.items[number - 1 :]):
        return RemainingMission((), "rtl")
    try:
        plan = guided_plan(_mission(onboard, firmware))
    except MissionError:
        return None
    return RemainingMission(tuple(t for t in plan.targets if t.item >= number), plan.end)


def _mission(onboard: OnboardMission, firmware: Firmware) -> Mission:
    """As the planner knows it. Heights above sea level are counted from the home that the vehicle told."""
    home = Home(
        onboard.home_lat_deg or 0.0,
        onboard.home_lon_deg or 0.0,
        math.nan if onboard.home_alt_amsl_m is None else onboard.home_alt_amsl_m,
        "EGM96 height",
    )
    return Mission(home, tuple(_item(item) for item in onboard.items), firmware=firmware)


def _item(item: Item) -> MissionItem:
    p1, p2, p3, p4 = (math.nan if value is None else value for value in item.params)
    return MissionItem(item.command, item.frame, (p1, p2, p3, p4), item.lat_deg, item.lon_deg, item.alt_m)


def _is_away(state: VehicleState) -> bool:
    lat_deg, lon_deg, home_lat_deg, home_lon_deg = state.lat_deg, state.lon_deg, state.home_lat_deg, state.home_lon_deg
    if lat_deg is None or lon_deg is None or home_lat_deg is None or home_lon_deg is None:
        return False
    return apart_m((lat_deg, lon_deg), (home_lat_deg, home_lon_deg)) > LANDS_M
