"""What the three perception nodes' programs have in common."""

from __future__ import annotations

import argparse
from pathlib import Path

from telemetry.bus import Bus
from telemetry.node import NodeContext, run_node
from telemetry.perception.kinds import SensorKind
from telemetry.perception.node import live


def run_perception(kind: SensorKind, description: str) -> int:
    """Runs one sensor's node until it ends; returns the exit code."""
    parser = argparse.ArgumentParser(prog=kind.sensor, description=description)
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")
    options = parser.parse_args()

    async def node(bus: Bus, context: NodeContext) -> None:
        await live(bus, context, kind)

    return run_node(kind.sensor, options.runtime, node)
