"""The vision node: ``python -m telemetry.nodes.vision --runtime DIR``. The local map of what the camera sees."""

import sys

from telemetry.perception.kinds import VISION
from telemetry.perception.program import run_perception


def main() -> int:
    return run_perception(VISION, "Maps what a stereo camera sees.")


if __name__ == "__main__":
    sys.exit(main())
