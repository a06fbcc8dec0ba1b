"""Which MAVLink commands carry a position, and how altitudes are written without ever going lower."""

from __future__ import annotations

import math

from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import Home, MissionItem
from planning.formats.safe_text import clean_name
from planning.terrain.vertical_datum import is_amsl

POSITIONED = frozenset(
    {
        MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_UNLIM, MavCmd.NAV_LOITER_TURNS, MavCmd.NAV_LOITER_TIME, MavCmd.NAV_LAND,
        MavCmd.NAV_TAKEOFF, MavCmd.NAV_LOITER_TO_ALT, MavCmd.DO_FOLLOW_REPOSITION, MavCmd.NAV_ARC_WAYPOINT,
        MavCmd.NAV_ROI, MavCmd.NAV_SPLINE_WAYPOINT, MavCmd.NAV_VTOL_TAKEOFF, MavCmd.NAV_VTOL_LAND,
        MavCmd.NAV_PAYLOAD_PLACE, MavCmd.DO_SET_HOME, MavCmd.DO_LAND_START, MavCmd.DO_REPOSITION,
        MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI,
    }
)  # fmt: skip
"""MAV_CMDs whose x, y, z are latitude, longitude and altitude."""
FLOWN_TO = frozenset(
    {
        MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_UNLIM, MavCmd.NAV_LOITER_TURNS, MavCmd.NAV_LOITER_TIME,
        MavCmd.NAV_LOITER_TO_ALT, MavCmd.NAV_ARC_WAYPOINT, MavCmd.NAV_SPLINE_WAYPOINT,
    }
)  # fmt: skip
"""MAV_CMDs that are places to visit."""

_SPELLING: dict[int, int] = {
    MavFrame.GLOBAL_INT: MavFrame.GLOBAL,
    MavFrame.GLOBAL_RELATIVE_ALT_INT: MavFrame.GLOBAL_RELATIVE_ALT,
    MavFrame.GLOBAL_TERRAIN_ALT_INT: MavFrame.GLOBAL_TERRAIN_ALT,
}


def plain_frame(frame: int) -> int:
    """MAV_FRAME without its obsolete _INT spelling (5 -> 0, 6 -> 3, 11 -> 10)."""
    return _SPELLING.get(frame, frame)


def has_position(item: MissionItem) -> bool:
    """Whether the item names a place; 0, 0 means "where the vehicle is"."""
    return item.command in POSITIONED and (item.lat_deg != 0.0 or item.lon_deg != 0.0)


def millimetres_up(alt_m: float) -> float:
    """Altitude rounded UP to the millimetre: rounding must never lower a waypoint.

    Not to the centimetre that vehicles keep: they cut, and what they cut from must be what was certified.
    """
    return math.ceil(alt_m * 1000.0 - 1e-6) / 1000.0


def home_altitude_note(home: Home) -> str:
    """One sentence on what the home altitude in a file means."""
    if not math.isfinite(home.alt_dsm_m):
        return "home altitude unknown"
    if is_amsl(home.vertical_datum):
        return f"home altitude {home.alt_dsm_m:.2f} m above mean sea level ({clean_name(home.vertical_datum)})"
    if home.vertical_datum is None:
        return (
            f"home altitude {home.alt_dsm_m:.2f} m in the surface model's undeclared vertical datum, not known as AMSL"
        )
    return f"home altitude {home.alt_dsm_m:.2f} m, datum {clean_name(home.vertical_datum)}, not AMSL"


def home_or_first_place(home: Home | None, items: list[MissionItem], warnings: list[str]) -> Home:
    """The home a file gave, otherwise the first place of the mission with unknown altitude, and a warning."""
    if home is not None:
        return home
    first = next((item for item in items if has_position(item)), None)
    if first is None:
        warnings.append("The file gives no home position.")
        return Home(math.nan, math.nan, math.nan)
    warnings.append("The file gives no home position; the first place of the mission was taken.")
    return Home(first.lat_deg, first.lon_deg, math.nan)
