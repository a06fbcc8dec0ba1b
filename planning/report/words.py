"""How the report says numbers and codes."""

from __future__ import annotations

import math
from collections.abc import Callable

from planning.formats.safe_text import clean_name
from planning.mav_cmd import MavCmd

COMMAND_NAMES = {
    16: "waypoint",
    17: "loiter without end",
    18: "loiter turns",
    19: "loiter",
    20: "return to launch",
    21: "land",
    22: "take-off",
    82: "spline waypoint",
    115: "yaw",
    177: "jump",
    178: "change speed",
    195: "region of interest",
    197: "no region of interest",
    201: "region of interest",
    203: "take a photo",
    205: "gimbal",
    206: "photo by distance",
    1000: "gimbal",
    2000: "take photos",
    2001: "stop photos",
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
