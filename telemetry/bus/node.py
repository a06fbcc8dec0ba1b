"""What all nodes have in common: one of each name, a place on the bus, log lines, a clean end."""

from __future__ import annotations

import asyncio
import logging
import signal
import sys
import time
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

from planning.errors import DescribedError
from telemetry.bus.bus import Bus
from telemetry.bus.node_lock import NodeLock
from telemetry.bus.sockets import private_directory
from telemetry.errors import BusError
from telemetry.topics.messages import ServerAlive, Topic

_log = logging.getLogger(__name__)

UNATTENDED_S, GIVEN_UP_S = 60.0, 600.0
"""Without a server; without a word of a vehicle that a node would go on for."""
LOOK_EVERY_S = 0.5
"""Whether a node is still needed."""
EXIT_ENDED, EXIT_FAILED, EXIT_REFUSED, EXIT_RUNNING_ALREADY = 0, 1, 2, 3


class NodeContext:
    """What a node may ask about its surroundings, and say about itself."""

    def __init__(self, lock: NodeLock) -> None:
        self._lock = lock
        self._started_t_mono_s = time.monotonic()
        self._server_t_mono_s: float | None = None

    def server_seen_s(self) -> float | None:
        """Seconds since a server (or a command that stands for one) last said that it lives; None: never yet."""
        return None if self._server_t_mono_s is None else time.monotonic() - self._server_t_mono_s

    def unattended_s(self) -> float:
        """Seconds without a server, counted from the start of this node if there never was one."""
        seen_s = self.server_seen_s()
        return time.monotonic() - self._started_t_mono_s if seen_s is None else seen_s

    def is_needed(self, heard_t_mono_s: float | None = None) -> bool:
        """Until there has been no server for a minute.

        ``heard_t_mono_s``: when the vehicle was last heard of whose flight this node goes on for, even so; not for one
        that nobody has heard of for long. None: there is no such flight. Who asks proves that the node does its work:
        one that has not asked for some seconds is ended and started anew.
        """
        self._lock.prove_alive()
        if self.unattended_s() < UNATTENDED_S:
            return True
        return heard_t_mono_s is not None and time.monotonic() - heard_t_mono_s < GIVEN_UP_S

    def set_replaceable(self, replaceable: bool) -> None:
        """Whether a server may end this node and start another in its place, without asking anybody.

        A link node says False while its vehicle is armed, and until it knows. All others begin with True.
        """
        self._lock.set_replaceable(replaceable)

    def note_server(self, alive: ServerAlive) -> None:
        self._server_t_mono_s = max(alive.t_mono_s, self._server_t_mono_s or alive.t_mono_s)


NodeMain = Callable[[Bus, NodeContext], Awaitable[object]]


def run_node(name: str, runtime_dir: Path, main: NodeMain, *, arguments: Sequence[str] | None = None) -> int:
    """Runs ``main`` until it returns or the process is asked to end (SIGTERM, SIGINT: ``main`` is cancelled).

    ``arguments``: what the node was started with, for whoever finds it running; by default the command line's.
    Returns the exit code: 0 ended, 1 failed, 2 refused (the reason is in the log), 3 there is such a node already.
    """
    _log_to_stderr()
    try:
        private_directory(runtime_dir)
        lock = NodeLock(runtime_dir, name, sys.argv[1:] if arguments is None else arguments)
    except BusError as error:
        _log.error("%s", error)
        return EXIT_REFUSED
    try:
        with lock:
            return _run(name, runtime_dir, main, NodeContext(lock))
    except BusError as error:  # of the lock: those of the node are dealt with inside
        _log.error("%s", error)
        return EXIT_RUNNING_ALREADY


def _run(name: str, runtime_dir: Path, main: NodeMain, context: NodeContext) -> int:
    _log.info("The %s node starts.", name)
    try:
        asyncio.run(_live(name, runtime_dir, main, context))
    except DescribedError as error:
        _log.error("The %s node cannot go on. %s", name, error)
        return EXIT_REFUSED
    except Exception:
        _log.exception("The %s node failed", name)
        return EXIT_FAILED
    _log.info("The %s node has ended.", name)
    return EXIT_ENDED


async def _live(name: str, runtime_dir: Path, main: NodeMain, context: NodeContext) -> None:
    asked = False
    working: asyncio.Future[object] | None = None

    def end() -> None:
        nonlocal asked
        asked = True
        if working is not None:
            working.cancel()

    for number in (signal.SIGTERM, signal.SIGINT):  # from here on, also while it joins the bus
        asyncio.get_running_loop().add_signal_handler(number, end)
    async with await Bus.open(runtime_dir, name) as bus:
        if asked:
            return
        working = asyncio.ensure_future(main(bus, context))
        listening = asyncio.ensure_future(_watch_server(bus, context))
        done, others = await asyncio.wait((working, listening), return_when=asyncio.FIRST_COMPLETED)
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        for task in done:
            if not task.cancelled():
                task.result()


async def _watch_server(bus: Bus, context: NodeContext) -> None:
    async for _, message in bus.subscribe(Topic.SERVER):
        if isinstance(message, ServerAlive):
            context.note_server(message)


class _OneLine(logging.Formatter):
    """A name that came over the air may hold line breaks and terminal commands; they forge no line here."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - the base class's name
        return "".join(
            c if c.isprintable() else c.encode("unicode_escape").decode() for c in super().formatMessage(record)
        )


def _log_to_stderr() -> None:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_OneLine("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
