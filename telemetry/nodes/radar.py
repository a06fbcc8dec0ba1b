"""The radar node: ``python -m telemetry.nodes.radar --runtime DIR``. The global map of what the radar has seen."""

import sys

from telemetry.perception.map_node import run_perception
from telemetry.perception.sensor_kinds import RADAR

if __name__ == "__main__":
    sys.exit(run_perception(RADAR, "Maps what a radar sees."))
