"""Positions that fail by script: the receiver's fix lost for a while, or the reported position elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, cast, get_args

from planning.errors import ParameterError
from telemetry.simulation.simulator.neu_frame import Vec3

GnssFault = Literal["loss", "glitch"]


@dataclass(frozen=True, slots=True)
class GnssEvent:
    """Times are simulated seconds since switching on."""

    kind: GnssFault
    start_s: float
    duration_s: float
    offset_neu: Vec3 = (0.0, 0.0, 0.0)
    """Of a glitch: where the reported position is from the estimated one, m."""

    def holds(self, now_s: float) -> bool:
        return self.start_s <= now_s < self.start_s + self.duration_s


def has_fix(script: tuple[GnssEvent, ...], now_s: float) -> bool:
    return not any(event.kind == "loss" and event.holds(now_s) for event in script)


def offset_neu(script: tuple[GnssEvent, ...], now_s: float) -> Vec3:
    """Sum of the glitches that hold now."""
    held = [event.offset_neu for event in script if event.kind == "glitch" and event.holds(now_s)]
    return sum(p[0] for p in held), sum(p[1] for p in held), sum(p[2] for p in held)


def read_event(text: str) -> GnssEvent:
    """``loss:START:SECONDS`` or ``glitch:START:SECONDS:METRES[:BEARING]`` (degrees from north, 90 unless given)."""
    kind, *numbers = text.split(":")
    try:
        values = [float(number) for number in numbers]
    except ValueError:
        values = []
    wanted = {"loss": (2, 2), "glitch": (3, 4)}.get(kind)
    if wanted is None or not wanted[0] <= len(values) <= wanted[1] or not _sensible(values):
        raise ParameterError(
            f'"{text}" is no GNSS event.',
            where="--gnss-event",
            advice=f"Write {' or '.join(get_args(GnssFault))}: such as loss:60:20 or glitch:60:5:100:90.",
        )
    start_s, duration_s, metres, bearing_deg = (*values, *(0.0, 90.0)[len(values) - 2 :])
    east, north = metres * math.sin(math.radians(bearing_deg)), metres * math.cos(math.radians(bearing_deg))
    return GnssEvent(cast(GnssFault, kind), start_s, duration_s, (north, east, 0.0))


def _sensible(values: list[float]) -> bool:
    return all(math.isfinite(value) and abs(value) < 1e6 for value in values) and values[0] >= 0 and values[1] > 0
