"""The ranges node: ``python -m telemetry.nodes.ranges --runtime DIR``. What the vehicle's range finders see."""

import sys

from telemetry.perception.kinds import RANGES
from telemetry.perception.program import run_perception


def main() -> int:
    return run_perception(RANGES, "Maps what the autopilot's range finders see.")


if __name__ == "__main__":
    sys.exit(main())
