"""What MAVLink writes for a figure that nobody knows, and the units in which it writes those that are known."""

from __future__ import annotations

import math

INT16_MAX, UINT16_MAX, INT32_MAX = 32767, 65535, 2147483647


def finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def heading(yaw_rad: float) -> float | None:
    """0 to 2 pi; rounding must not let a tiny negative angle become 2 pi itself."""
    if not math.isfinite(yaw_rad):
        return None
    wrapped = yaw_rad % math.tau
    return wrapped if wrapped < math.tau else 0.0


def scaled(value: int, divisor: int, unknown: int) -> float | None:
    return None if value == unknown else value / divisor


def accuracy(millimetres: int) -> float | None:
    """0 is what a message without the extension fields decodes to, 2**32 - 1 what some receivers write for unknown."""
    return millimetres / 1000 if 0 < millimetres < 4_000_000_000 else None


def share(percent: int) -> float | None:
    return percent / 100 if 0 <= percent <= 100 else None


def lat_lon(lat_e7: int, lon_e7: int) -> tuple[float | None, float | None]:
    """Both or none. Exactly 0, 0 is what ArduPilot sends before it has a position."""
    if (lat_e7 == 0 and lon_e7 == 0) or abs(lat_e7) > 900_000_000 or abs(lon_e7) > 1_800_000_000:
        return None, None
    return lat_e7 / 1e7, lon_e7 / 1e7
