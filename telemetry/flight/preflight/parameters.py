"""The vehicle's own settings on which a flight rests, whatever its firmware calls them: return, speeds, fence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Firmware
from planning.certificate.commands import STRAIGHT
from planning.certificate.returns import NEAR_M, SLOPE
from planning.flight_time.return_speeds import ReturnSpeeds
from telemetry.flight.fence_heights import highest_return_m
from telemetry.flight.guided.script_targets import GROUND_SPEEDS
from telemetry.topics.onboard_lists import OnboardMission

NAMES: dict[Firmware, tuple[str, ...]] = {
    "ardupilot": (
        *("RTL_ALT", "RTL_ALT_M", "RTL_CLIMB_MIN", "RTL_CLIMB_MIN_M", "RTL_CONE_SLOPE"),
        *("RTL_SPEED", "RTL_SPEED_MS", "WPNAV_SPEED", "WP_SPD", "PSC_JERK_XY", "PSC_JERK_NE"),
        *("WPNAV_SPEED_UP", "WP_SPD_UP", "WPNAV_SPEED_DN", "WP_SPD_DN", "RTL_LOIT_TIME"),
        *("LAND_SPEED", "LAND_SPD_MS", "LAND_SPEED_HIGH", "LAND_SPD_HIGH_MS", "LAND_ALT_LOW", "LAND_ALT_LOW_M"),
        *("RTL_ALT_FINAL", "RTL_ALT_FINAL_M"),
        *("FENCE_ENABLE", "FENCE_AUTOENABLE", "FENCE_TYPE", "FENCE_ACTION", "FENCE_MARGIN"),
        *("FENCE_ALT_MAX", "FENCE_ALT_MIN", "FENCE_RADIUS"),
        *("FENCE_ALT_MAX_TP", "FENCE_ALT_MIN_TP"),
    ),
    "px4": (
        *("RTL_RETURN_ALT", "RTL_CONE_ANG", "RTL_MIN_DIST", "RTL_LAND_DELAY", "GF_ACTION"),
        *("GF_MAX_VER_DIST", "GF_MAX_HOR_DIST"),
        *("MPC_XY_CRUISE", "MPC_Z_V_AUTO_UP", "MPC_Z_V_AUTO_DN", "MPC_LAND_SPEED", "MPC_LAND_ALT1"),
    ),
}
"""What to read before a start. ArduPilot 4.7 counts in metres what earlier versions count in centimetres."""
NEAR_HALF_DEG = 45.0
"""Of PX4's cone, from the vertical: the larger, the lower it flies close to home; 0 switches the cone off."""
CRUISE, HOME, JERK = ("WP_SPD", "WPNAV_SPEED"), ("RTL_SPEED_MS", "RTL_SPEED"), ("PSC_JERK_NE", "PSC_JERK_XY")
"""ArduPilot's names, those of 4.7 and newer first."""
UP, DOWN = ("WP_SPD_UP", "WPNAV_SPEED_UP"), ("WP_SPD_DN", "WPNAV_SPEED_DN")
LAND, LAND_FAST = ("LAND_SPD_MS", "LAND_SPEED"), ("LAND_SPD_HIGH_MS", "LAND_SPEED_HIGH")
LAND_LOW = ("LAND_ALT_LOW_M", "LAND_ALT_LOW")
IN_CM = frozenset(names[1] for names in (CRUISE, HOME, UP, DOWN, LAND, LAND_FAST, LAND_LOW))


@dataclass(frozen=True, slots=True)
class ReturnSettings:
    """How the vehicle goes home."""

    height_m: float | None
    """Above home; a vehicle that is higher already keeps its height. None: not known."""
    parameter: str
    """Its name, to be set when it has to change."""
    steep_enough: bool
    """Close to home it climbs as much as certificates take for granted."""
    below_ceiling: bool = False
    """The ceiling on board keeps ``height_m`` lower than ``parameter`` says."""

    def value_for(self, height_m: float) -> str:
        """What to write into ``parameter`` for a height, rounded up to whole metres."""
        metres = math.ceil(height_m)
        return f"{self.parameter} {metres * 100} cm" if self.parameter == "RTL_ALT" else f"{self.parameter} {metres} m"


def return_settings(parameters: Mapping[str, float | None], firmware: Firmware) -> ReturnSettings:
    """From what was read; names that the vehicle does not have may be missing or None."""
    known = {name: value for name, value in parameters.items() if value is not None and math.isfinite(value)}
    if firmware == "px4":
        half_deg, within_m = known.get("RTL_CONE_ANG", NEAR_HALF_DEG), known.get("RTL_MIN_DIST", NEAR_M)
        steep_enough = half_deg <= 0.0 or (half_deg <= NEAR_HALF_DEG and within_m <= NEAR_M)
        return ReturnSettings(known.get("RTL_RETURN_ALT"), "RTL_RETURN_ALT", steep_enough)
    slope = known.get("RTL_CONE_SLOPE", SLOPE)
    steep_enough = slope <= 0.0 or slope >= SLOPE  # 0 switches the cone off
    if "RTL_ALT_M" in known:
        return ReturnSettings(known["RTL_ALT_M"], "RTL_ALT_M", steep_enough)
    height_m = known["RTL_ALT"] / 100.0 if "RTL_ALT" in known else None
    return ReturnSettings(height_m, "RTL_ALT", steep_enough)


def return_as_flown(parameters: Mapping[str, float | None], firmware: Firmware) -> ReturnSettings:
    """As the vehicle is set, and no higher than its own ceiling lets it."""
    own, most_m = return_settings(parameters, firmware), highest_return_m(parameters, firmware)
    if own.height_m is None or own.height_m <= most_m:
        return own
    return replace(own, height_m=most_m, below_ceiling=True)


@dataclass(frozen=True, slots=True)
class Speeds:
    """None: not known."""

    mission_m_s: float | None = None
    """The largest."""
    home_m_s: float | None = None
    home_parameter: str = ""
    """That sets it; empty where none is known."""
    brake_jerk_m_s3: float | None = None

    def home_value(self, speed_m_s: float) -> str:
        """What to write into ``home_parameter``, rounded down."""
        tenths = math.floor(10 * speed_m_s + 1e-9)
        cm = self.home_parameter in IN_CM
        return f"{self.home_parameter} {10 * tenths} cm/s" if cm else f"{self.home_parameter} {tenths / 10:g} m/s"


def flown_speeds(parameters: Mapping[str, float | None], onboard: OnboardMission | None, firmware: Firmware) -> Speeds:
    """Of ArduPilot; of another autopilot nothing is known. RTL_SPEED 0 stands for the mission's cruising speed."""
    if firmware != "ardupilot":
        return Speeds()
    _, cruise_m_s = _first(parameters, CRUISE)
    name, home_m_s = _first(parameters, HOME)
    _, jerk = _first(parameters, JERK)
    return Speeds(_mission_m_s(onboard, cruise_m_s), home_m_s or cruise_m_s, name, jerk or None)


def return_speeds(parameters: Mapping[str, float | None], firmware: Firmware) -> ReturnSpeeds:
    """As the vehicle is set. PX4's delay before it lands counts where it is one: below 0 it never lands by itself,
    nor does ArduPilot with a final height."""
    height_m = return_as_flown(parameters, firmware).height_m
    if firmware == "px4":
        cruise_m_s, up_m_s, down_m_s, land_m_s, low_m, wait_s = (
            _first(parameters, (name,))[1]
            for name in (
                *("MPC_XY_CRUISE", "MPC_Z_V_AUTO_UP", "MPC_Z_V_AUTO_DN"),
                *("MPC_LAND_SPEED", "MPC_LAND_ALT1", "RTL_LAND_DELAY"),
            )
        )
        lands, wait_s = (wait_s or 0.0) >= 0.0, None if wait_s is None else max(0.0, wait_s)
        return ReturnSpeeds(cruise_m_s, up_m_s, down_m_s, land_m_s, low_m, wait_s, height_m, lands)
    level_m_s, up_m_s, down_m_s, land_m_s, fast_m_s, low_m, wait_ms = (
        _first(parameters, names)[1] for names in (HOME, UP, DOWN, LAND, LAND_FAST, LAND_LOW, ("RTL_LOIT_TIME",))
    )
    return ReturnSpeeds(
        level_m_s or _first(parameters, CRUISE)[1],
        up_m_s,
        fast_m_s or down_m_s,
        land_m_s,
        low_m,
        None if wait_ms is None else wait_ms / 1000,
        height_m,
        (_first(parameters, ("RTL_ALT_FINAL_M", "RTL_ALT_FINAL"))[1] or 0.0) <= 0.0,
    )


def _first(parameters: Mapping[str, float | None], names: tuple[str, ...]) -> tuple[str, float | None]:
    """The name that the vehicle has, and its value in metres."""
    for name in names:
        value = parameters.get(name)
        if value is not None and math.isfinite(value):
            return name, value / 100 if name in IN_CM else value
    return "", None


def _mission_m_s(onboard: OnboardMission | None, cruise_m_s: float | None) -> float | None:
    """The largest that any leg is flown at; None where a leg's is not known."""
    speed_m_s, flown = cruise_m_s, list[float | None]()
    for item in onboard.items if onboard is not None else ():
        kind, value = item.params[0], item.params[1]
        if item.command == MavCmd.DO_CHANGE_SPEED and kind in GROUND_SPEEDS and value is not None and value > 0:
            speed_m_s = value
        elif item.command in STRAIGHT:
            flown.append(speed_m_s)
    known = [speed for speed in flown if speed is not None]
    return max(known) if flown and len(known) == len(flown) else None
