"""Ports for what is started later: of none that the system gives away by itself meanwhile."""

from __future__ import annotations

import contextlib
import os
import random
import socket

_FIRST, _EACH, _WORKERS = 15_000, 2_000, 8
"""All lie below the ports that the kernel hands out to whoever asks for any (32,768 on)."""
_drawn = random.Random(os.urandom(8))
_given = set[int]()


def free_port() -> int:
    """On loopback, for TCP and UDP; each test worker has ports of its own, and each is given once."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % _WORKERS
    first = _FIRST + _EACH * worker
    while len(_given) < _EACH:
        port = _drawn.randrange(first, first + _EACH)
        if port not in _given and _is_free(port):
            _given.add(port)
            return port
    raise AssertionError("No port is left.")


def _is_free(port: int) -> bool:
    with contextlib.ExitStack() as held, contextlib.suppress(OSError):
        for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM):
            held.enter_context(socket.socket(socket.AF_INET, kind)).bind(("127.0.0.1", port))
        return True
    return False
