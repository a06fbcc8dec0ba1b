"""The tracks node: ``python -m telemetry.nodes.tracks --runtime DIR``. Follows what moves, and says what comes near."""

import sys

import argparse
import sys
from pathlib import Path

from telemetry.node import run_node
from telemetry.tracking.kind import NAME
from telemetry.tracking.node import live


def main() -> int:
    parser = argparse.ArgumentParser(prog=NAME, description="Follows what moves before a radar.")
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")
    return run_node(NAME, parser.parse_args().runtime, live)


if __name__ == "__main__":
    sys.exit(main())
