"""Nodes of a command's own: the same programs as the server's, in a private directory that goes with the command."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from server.library.directory_lock import locked
from server.work.supervisor import Supervisor
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.topics.messages import ServerAlive, Topic
from telemetry.topics.requests import Operator

ALIVE_EVERY_S = 1.0
OPERATOR = Operator("command line", 1)


@dataclass(frozen=True, slots=True)
class Station:
    """What a command needs to reach a vehicle."""

    bus: Bus
    link: LinkClient
    recordings: Path
    """Empty at first; goes with the command."""


@asynccontextmanager
async def own_nodes(*, recorder: bool, data_dir: Path | None = None) -> AsyncIterator[Station]:
    """A link node, and a recorder node if asked for, that are ended with the block.

    The link signs with the keys of ``data_dir`` and writes its commands into the log there. Raises ``DataDirError``
    where there is none, or where a server uses it: two that count on would each spoil the other's signatures.
    """
    with contextlib.nullcontext() if data_dir is None else locked(data_dir):
        async with _nodes(recorder, () if data_dir is None else ("--data", str(data_dir.resolve()))) as station:
            yield station


@asynccontextmanager
async def _nodes(recorder: bool, link_options: tuple[str, ...]) -> AsyncIterator[Station]:
    folder = Path(tempfile.mkdtemp(prefix="hedgehop-"))
    recordings = folder / "recordings"
    recordings.mkdir(mode=0o700)
    runtime = folder / "run"
    supervisor = Supervisor(runtime, changed=lambda states: None)
    names = {"link": link_options, **({"recorder": ("--recordings", str(recordings))} if recorder else {})}
    failure: BaseException | None = None
    try:
        async with asyncio.TaskGroup() as tasks:
            running = [tasks.create_task(supervisor.run())]
            async with await Bus.open(runtime, f"cli-{os.getpid()}") as bus:
                running.append(tasks.create_task(_stand_for_a_server(bus)))
                try:
                    for name, arguments in names.items():
                        await supervisor.start(name, arguments)
                    yield Station(bus, LinkClient(bus), recordings)
                except BaseException as error:  # raised again below: the group would wrap it
                    failure = error
                finally:
                    for name in names:
                        await supervisor.stop(name)
                    for task in running:
                        task.cancel()
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
    if failure is not None:
        raise failure


async def _stand_for_a_server(bus: Bus) -> None:
    """Nodes stop when nobody is there for whom they work."""
    while True:
        bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), os.getpid()))
        await asyncio.sleep(ALIVE_EVERY_S)
