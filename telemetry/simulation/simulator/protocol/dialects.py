"""The dialects by the make of their autopilot."""

from __future__ import annotations

from telemetry.simulation.simulator.autopilot.personality import Make
from telemetry.simulation.simulator.protocol.ardupilot_dialect import ARDUPILOT
from telemetry.simulation.simulator.protocol.dialect import Dialect
from telemetry.simulation.simulator.protocol.px4.px4_dialect import PX4

DIALECTS: dict[Make, Dialect] = {"ardupilot": ARDUPILOT, "px4": PX4}
