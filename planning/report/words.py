"""How the report says numbers and codes."""

from __future__ import annotations

import math
from collections.abc import Callable

from planning.basics.mav_cmd import MavCmd
from planning.formats.safe_text import clean_name

COMMAND_NAMES: dict[int, str] = {
    MavCmd.NAV_WAYPOINT: "waypoint",
    MavCmd.NAV_LOITER_UNLIM: "loiter without end",
    MavCmd.NAV_LOITER_TURNS: "loiter turns",
    MavCmd.NAV_LOITER_TIME: "loiter",
    MavCmd.NAV_RETURN_TO_LAUNCH: "return to launch",
    MavCmd.NAV_LAND: "land",
    MavCmd.NAV_TAKEOFF: "take-off",
    MavCmd.NAV_SPLINE_WAYPOINT: "spline waypoint",
    MavCmd.CONDITION_YAW: "yaw",
    MavCmd.DO_JUMP: "jump",
    MavCmd.DO_CHANGE_SPEED: "change speed",
    MavCmd.DO_SET_ROI_LOCATION: "region of interest",
    MavCmd.DO_SET_ROI_NONE: "no region of interest",
    MavCmd.DO_SET_ROI: "region of interest",
    MavCmd.DO_DIGICAM_CONTROL: "take a photo",
    MavCmd.DO_MOUNT_CONTROL: "gimbal",
    MavCmd.DO_SET_CAM_TRIGG_DIST: "photo by distance",
    MavCmd.DO_GIMBAL_MANAGER_PITCHYAW: "gimbal",
    MavCmd.IMAGE_START_CAPTURE: "take photos",
    MavCmd.IMAGE_STOP_CAPTURE: "stop photos",
}
"""MAV_CMD -> words."""
_UNITS = (
    ("_m_s2", " m/s²"),
    ("_m_s", " m/s"),
    ("_m2", " m²"),
    ("_deg", "°"),
    ("_px", " px"),
    ("_m", " m"),
    ("_s", " s"),
)
_ABBREVIATIONS = {"dsm": "DSM", "crs": "CRS", "rtl": "RTL", "poi": "POI", "sha256": "SHA-256"}


def metres(value_m: float, decimals: int = 2) -> str:
    """A length, or a word where there is none; rounded down, so that no clearance is flattered."""
    scale = 10**decimals
    return _length(value_m, lambda m: math.floor(m * scale + 1e-6) / scale, decimals)


def metres_up(value_m: float, decimals: int = 2) -> str:
    """A length rounded up: for what is demanded, and for what should be small."""
    scale = 10**decimals
    return _length(value_m, lambda m: math.ceil(m * scale - 1e-6) / scale, decimals)


def _length(value_m: float, rounded: Callable[[float], float], decimals: int) -> str:
    if math.isnan(value_m):
        return "unknown"
    if math.isinf(value_m):
        return "unlimited" if value_m > 0 else "over unknown terrain"
    return f"{rounded(value_m) + 0.0:.{decimals}f} m"


def duration(seconds: float) -> str:
    """Minutes and seconds."""
    if not math.isfinite(seconds):
        return "unknown"
    minutes, rest = divmod(round(seconds), 60)
    if not minutes:
        return f"{rest} s"
    return f"{minutes} min {rest:02d} s" if rest else f"{minutes} min"


def assumption_rows(assumptions: dict[str, object]) -> list[tuple[str, str]]:
    """The certificate's assumptions as (words, value with unit); nested ones are laid flat."""
    rows: list[tuple[str, str]] = []
    for key, value in assumptions.items():
        rows += assumption_rows(value) if isinstance(value, dict) else [_row(key, value)]
    return rows


def _row(key: str, value: object) -> tuple[str, str]:
    stem, unit = key, ""
    for suffix, symbol in _UNITS:
        if key.endswith(suffix):
            stem, unit = key.removesuffix(suffix), symbol
            break
    words = " ".join(_ABBREVIATIONS.get(word, word) for word in stem.split("_"))
    return words[:1].upper() + words[1:], _value(value, unit)


def _value(value: object, unit: str) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return "; ".join(_value(v, unit) for v in value) or "none"
    if isinstance(value, float):
        return f"{value:.6g}{unit}"
    if isinstance(value, int):
        return f"{value}{unit}"
    text = str(value)
    # Hashes and texts longer than a name are kept whole, line by line in the cell.
    return text if text.isprintable() and len(text) <= 600 else clean_name(text)
