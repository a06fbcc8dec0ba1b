"""How fast a vehicle will fly its mission and its way home, by its mission and its own settings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from planning.certificate.commands import STRAIGHT
from planning.mav_cmd import MavCmd
from planning.model import Firmware
from telemetry.flight.guided.targets import GROUND_SPEEDS
from telemetry.topics.messages import OnboardMission

CRUISE, HOME, JERK = ("WP_SPD", "WPNAV_SPEED"), ("RTL_SPEED_MS", "RTL_SPEED"), ("PSC_JERK_NE", "PSC_JERK_XY")
"""ArduPilot's names, those of 4.7 and newer first."""
IN_CM = frozenset({"WPNAV_SPEED", "RTL_SPEED"})


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
