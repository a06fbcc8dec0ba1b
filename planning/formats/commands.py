"""Which MAVLink commands carry a position, and how altitudes are written without ever going lower."""

from __future__ import annotations

import math

from planning.formats.safe_text import clean_name
from planning.mav_cmd import MavCmd, MavFrame
from planning.model import Home, MissionItem
from planning.terrain.dsm import is_amsl

POSITIONED = frozenset({16, 17, 18, 19, 21, 22, 31, 33, 36, 80, 82, 84, 85, 94, 179, 189, 192, 195, 201})
"""MAV_CMDs whose x, y, z are latitude, longitude and altitude."""
FLOWN_TO = frozenset({16, 17, 18, 19, 31, 36, 82})
"""MAV_CMDs that are places to visit."""
NAV_LOITER_TIME = 19
NAV_WAYPOINT = 16
FRAME_AMSL, FRAME_NONE, FRAME_HOME, FRAME_TERRAIN = 0, 2, 3, 10

_SPELLING = {5: FRAME_AMSL, 6: FRAME_HOME, 11: FRAME_TERRAIN}


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
