"""The radar node: ``python -m telemetry.nodes.radar --runtime DIR``. The global map of what the radar has seen."""

import sys

from telemetry.perception.kinds import RADAR
from telemetry.perception.program import run_perception


def main() -> int:
    return run_perception(RADAR, "Maps what a radar sees.")


if __name__ == "__main__":
    sys.exit(main())
