"""The vehicle's own settings on which the clearance of a flight rests, whatever its firmware calls them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from planning.certificate.returns import SLOPE
from planning.model import Firmware

NAMES: dict[Firmware, tuple[str, ...]] = {
    "ardupilot": (
        *("RTL_ALT", "RTL_ALT_M", "RTL_CLIMB_MIN", "RTL_CLIMB_MIN_M", "RTL_CONE_SLOPE"),
        *("RTL_SPEED", "RTL_SPEED_MS", "WPNAV_SPEED", "WP_SPD", "PSC_JERK_XY", "PSC_JERK_NE"),
    ),
    "px4": ("RTL_RETURN_ALT", "RTL_CONE_ANG"),
}
"""What to read before a start. ArduPilot 4.7 counts in metres what earlier versions count in centimetres."""


@dataclass(frozen=True, slots=True)
class ReturnSettings:
    """How the vehicle goes home."""

    height_m: float | None
    """Above home; a vehicle that is higher already keeps its height. None: not known."""
    parameter: str
    """Its name, to be set when it has to change."""
    steep_enough: bool
    """Close to home it climbs as much as certificates take for granted."""

    def value_for(self, height_m: float) -> str:
        """What to write into ``parameter`` for a height, rounded up to whole metres."""
        metres = math.ceil(height_m)
        return f"{self.parameter} {metres * 100} cm" if self.parameter == "RTL_ALT" else f"{self.parameter} {metres} m"


def return_settings(parameters: Mapping[str, float | None], firmware: Firmware) -> ReturnSettings:
    """From what was read; names that the vehicle does not have may be missing or None."""
    known = {name: value for name, value in parameters.items() if value is not None and math.isfinite(value)}
    if firmware == "px4":
        angle_deg = known.get("RTL_CONE_ANG", 45.0)
        return ReturnSettings(known.get("RTL_RETURN_ALT"), "RTL_RETURN_ALT", angle_deg >= 45.0)
    slope = known.get("RTL_CONE_SLOPE", SLOPE)
    steep_enough = slope <= 0.0 or slope >= SLOPE  # 0 switches the cone off
    if "RTL_ALT_M" in known:
        return ReturnSettings(known["RTL_ALT_M"], "RTL_ALT_M", steep_enough)
    height_m = known["RTL_ALT"] / 100.0 if "RTL_ALT" in known else None
    return ReturnSettings(height_m, "RTL_ALT", steep_enough)
