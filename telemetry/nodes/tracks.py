"""The tracks node: ``python -m telemetry.nodes.tracks --runtime DIR``. Follows what moves, and says what comes near."""

import sys

from telemetry.perception.sensor_node import run_sensor_node
from telemetry.tracking.tracks_node import TracksNode

if __name__ == "__main__":
    sys.exit(run_sensor_node("tracks", "Follows what moves before a radar.", TracksNode))
