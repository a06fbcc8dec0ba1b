"""``python -m tests.bench.with_points POINTS serve ...``: ``hedgehop`` whose simulated camera has so many rays."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from server.cli import main
from server.heard.node_states import SIMULATED_SENSORS
from server.work.supervisor import Supervisor

_start = Supervisor.start


def with_points(points: str) -> None:
    async def start(self: Supervisor, name: str, arguments: Sequence[str]) -> None:
        more = ["--points", points] if name == SIMULATED_SENSORS else []
        await _start(self, name, [*arguments, *more])

    Supervisor.start = start


if __name__ == "__main__":
    with_points(sys.argv.pop(1))
    main()
