"""How far an autopilot departs from the straight legs it is given: a table of what was measured.

Distances in space between the flown track and the line from the first waypoint to the last, by the vehicle's own
estimate; the worst of each row counts, not its 95th percentile, for a certificate holds everywhere. All flights were
made with default parameters and the autopilots' own built-in physics. Beyond the speed that was flown the worst grows
with the square of the speed, as the way round a corner at the same acceleration does; below it, it stays. In GUIDED
the recorded ArduCopter was sent places; led along its legs it departs less in simulation, which no recording supports
yet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Firmware = Literal["ardupilot", "px4"]
Way = Literal["auto", "guided"]
"""The mission on board, or waypoints handed over one at a time."""

WAY_NAMES: dict[Way, str] = {"auto": "AUTO", "guided": "GUIDED"}
FIRMWARE_NAMES: dict[Firmware, str] = {"ardupilot": "ArduPilot", "px4": "PX4"}


@dataclass(frozen=True, slots=True)
class Measured:
    """One row of the table."""

    worst_m: float
    """Rounded up to the next decimetre."""
    speed_m_s: float
    """Up to which it was flown."""
    source: str


MEASURED: dict[tuple[Firmware, Way], Measured] = {
    ("ardupilot", "auto"): Measured(
        1.1,
        6.0,
        "ArduCopter 4.7, four flights, two of them in 5 m/s of wind: at most 1.05 m beside the line and 0.89 m below"
        " it, 95 % within 0.43 m",
    ),
    ("ardupilot", "guided"): Measured(
        1.8,
        6.0,
        "ArduCopter 4.7, three flights: at most 1.72 m from the line, below it; height and place are shaped apart,"
        " 95 % within 1.25 m",
    ),
    ("px4", "auto"): Measured(
        1.0, 5.0, "PX4 1.17 with RTK: at most 0.99 m below the line and 0.92 m beside it, 95 % within 0.85 m"
    ),
    ("px4", "guided"): Measured(
        1.2, 5.0, "PX4 1.17 with RTK: at most 1.12 m from the line, beside it, 95 % within 0.77 m"
    ),
}


def following_error_m(firmware: Firmware, way: Way, speed_m_s: float) -> float:
    """The farthest that a vehicle is taken to depart from the line at this speed."""
    row = MEASURED[firmware, way]
    return row.worst_m * max(1.0, speed_m_s / row.speed_m_s) ** 2


def following_source(firmware: Firmware, way: Way, speed_m_s: float) -> str:
    """What the value rests on, in words."""
    row = MEASURED[firmware, way]
    grown = f", grown to {speed_m_s:g} m/s by its square" if speed_m_s > row.speed_m_s else ""
    return f"measured, {FIRMWARE_NAMES[firmware]} in {WAY_NAMES[way]} up to {row.speed_m_s:g} m/s{grown}: {row.source}"
