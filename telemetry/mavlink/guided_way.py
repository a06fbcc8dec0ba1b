"""How a vehicle is led through the places of GUIDED, by its own settings."""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from planning.model import Firmware
from telemetry.errors import TelemetryError
from telemetry.flight.feed import Feed

OPTIONS, STRAIGHT_LEGS = "GUID_OPTIONS", 64
"""ArduCopter then flies to the places of GUIDED as it does to waypoints."""
TIMEOUT, LEAST_SILENT_S = "GUID_TIMEOUT", 3.0
"""A shorter one would let it be led faster than it was simulated."""


@dataclass(frozen=True, slots=True)
class GuidedWay:
    feed: Feed | None = None
    """None: it is sent its places."""
    note: str = ""


async def guided_way(firmware: Firmware, read_parameter: Callable[[str], Awaitable[float | None]]) -> GuidedWay:
    """What is not known is taken for the worse."""
    if firmware != "ardupilot":
        return GuidedWay()
    options = await _known(OPTIONS, read_parameter)
    if options is not None and int(options) & STRAIGHT_LEGS:
        return GuidedWay()
    silent_s = max(await _known(TIMEOUT, read_parameter) or 0.0, LEAST_SILENT_S)
    note = (
        "In GUIDED this vehicle shapes height and place apart: it is led along the legs, ten times a second, no faster"
        f" than a link that falls silent for {silent_s:g} s allows."
        f" Set {OPTIONS} {STRAIGHT_LEGS | int(options or 0)} on the vehicle, and it flies straight legs by itself;"
        " or fly in AUTO."
    )
    return GuidedWay(Feed(silent_s=silent_s), note)


async def _known(name: str, read_parameter: Callable[[str], Awaitable[float | None]]) -> float | None:
    with contextlib.suppress(TelemetryError):
        return await read_parameter(name)
    return None
