"""The vision node: ``python -m telemetry.nodes.vision --runtime DIR``. The local map of what the camera sees."""

import sys

from telemetry.perception.map_node import run_perception
from telemetry.perception.sensor_kinds import VISION

if __name__ == "__main__":
    sys.exit(run_perception(VISION, "Maps what a stereo camera sees."))
