"""A simulated vehicle as a process of its own, for tests that fly."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

QUICKLY_DOWN = ("--parameter=LAND_SPEED=150", "--parameter=LAND_ALT_LOW=200")
"""Options of a vehicle that does not creep over its last ten metres."""


@contextmanager
def simulated_vehicle(home: str, *options: object) -> Iterator[str]:
    """The link string of a vehicle that stands at ``home`` (LAT,LON,ALT)."""
    command = [sys.executable, "-m", "telemetry.nodes.simulator", "--link", "tcpin:127.0.0.1:0", "--home", home]
    process = subprocess.Popen([*command, *map(str, options)], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r"tcp:127\.0\.0\.1:\d+", line)
        assert found, line
        yield found[0]
    finally:
        process.terminate()
        process.wait(30)
        if process.stdout is not None:
            process.stdout.close()
