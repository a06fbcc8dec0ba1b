"""The ranges node: ``python -m telemetry.nodes.ranges --runtime DIR``. What the vehicle's range finders see."""

import sys

from telemetry.perception.map_node import run_perception
from telemetry.perception.sensor_kinds import RANGES

if __name__ == "__main__":
    sys.exit(run_perception(RANGES, "Maps what the autopilot's range finders see."))
