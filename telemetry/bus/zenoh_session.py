"""Opening Zenoh as a mesh of peers over Unix sockets, with everything off that would look beyond this machine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import zenoh

from telemetry.bus.sockets import endpoint, neighbours
from telemetry.errors import BusError

_SETTINGS: dict[str, Any] = {
    "mode": "peer",
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "scouting/delay": 0,
    "open/return_conditions/connect_scouted": False,
    "open/return_conditions/declares": False,
    "timestamping/enabled": False,
    "transport/shared_memory/enabled": False,
    "transport/link/protocols": ["unixsock-stream"],
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
    "transport/link/tx/queue/size/interactive_high": 16,
    "transport/link/tx/queue/size/data": 16,
    # Peers come and go at any time and in any order.
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "connect/retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 1.5},
    "listen/timeout_ms": 0,
    "listen/exit_on_failure": True,
}


def open_session(folder: Path, name: str) -> zenoh.Session:
    """Blocks for some milliseconds. Raises BusError when the name is taken."""
    others = neighbours(folder, name)
    while True:
        session = _open(folder, name, others)
        # A guest that came at the same moment is seen by whichever of the two looks last.
        now = neighbours(folder, name)
        if set(now) <= set(others):
            return session
        session.close()
        others = now


def _open(folder: Path, name: str, others: list[str]) -> zenoh.Session:
    config = zenoh.Config()
    for key, value in _SETTINGS.items():
        config.insert_json5(key, json.dumps(value))
    config.insert_json5("listen/endpoints", json.dumps([endpoint(folder, name)]))
    config.insert_json5("connect/endpoints", json.dumps([endpoint(folder, other) for other in others]))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise BusError(
            f"The name {name!r} on the bus is taken, or its socket cannot be made.",
            where=str(folder),
            advice=f"End the other process that is called {name!r}; see that the disk is neither full nor read-only.",
        ) from error
