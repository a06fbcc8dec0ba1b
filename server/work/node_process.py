"""One node's process, started here or found running: it lives in a session of its own and survives the server."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from planning.terrain.rasters.confinement import plain_environment
from telemetry.bus import spare_node
from telemetry.bus.node_lock import NodeFacts, running_node

LOG_BYTES = 2_000_000
_LOOK_EVERY_S = 0.1
_END_WITHIN_S = 8.0


class NodeProcess:
    """A process that is waited for; whether it is our child or another server's makes no difference outside."""

    def __init__(self, runtime_dir: Path, name: str, pid: int, *, child: bool) -> None:
        self.pid = pid
        self._runtime_dir = runtime_dir
        self._name = name
        self._child = child
        self._ended = False
        self.code: int | None = None
        """Exit code, minus the signal's number if one ended it; None while it runs, and for what we did not start."""

    @classmethod
    def start(cls, runtime_dir: Path, name: str, package: str, arguments: Sequence[str]) -> NodeProcess:
        command = [f"{package}.{name}", *arguments]
        return cls(runtime_dir, name, _spawn(runtime_dir, name, command), child=True)

    @classmethod
    def adopt(cls, runtime_dir: Path, facts: NodeFacts) -> NodeProcess:
        return cls(runtime_dir, facts.name, facts.pid, child=False)

    def facts(self) -> NodeFacts | None:
        """What the process says of itself, once it holds its lock."""
        facts = running_node(self._runtime_dir, self._name)
        return facts if facts and facts.pid == self.pid else None

    def has_ended(self) -> bool:
        if not self._ended:
            self._ended = self._reaped() if self._child else self.facts() is None
        return self._ended

    async def ended(self) -> None:
        while not self.has_ended():
            await asyncio.sleep(_LOOK_EVERY_S)

    async def end(self) -> None:
        """SIGTERM, and SIGKILL for what has not ended 8 s later."""
        self._signal(signal.SIGTERM)
        try:
            async with asyncio.timeout(_END_WITHIN_S):
                await self.ended()
        except TimeoutError:
            self.kill()
            await self.ended()

    def kill(self) -> None:
        """At once: what hangs would not hear SIGTERM."""
        self._signal(signal.SIGKILL)

    def _signal(self, number: signal.Signals) -> None:
        # A process that is not our child is named by its lock: without it, its number may be somebody else's by now.
        if not self.has_ended():
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def _reaped(self) -> bool:
        try:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
        except ChildProcessError:
            return True
        if pid == 0:
            return False
        self.code = os.waitstatus_to_exitcode(status)
        return True


class SpareNode:
    """One that has loaded all that it needs and waits to take the place of one that dies: loading takes a second, and
    several where the machine is busy. It ends with the server."""

    def __init__(self, runtime_dir: Path, name: str, package: str) -> None:
        waits, self._tells = os.pipe()
        try:
            command = [spare_node.__name__, f"{package}.{name}"]
            pid = _spawn(runtime_dir, name, command, stdin=waits)
        except BaseException:
            os.close(self._tells)
            raise
        finally:
            os.close(waits)
        self.process = NodeProcess(runtime_dir, name, pid, child=True)

    def take(self, arguments: Sequence[str]) -> NodeProcess | None:
        """The process, which runs now. None where it has ended."""
        try:
            if self.process.has_ended():
                return None
            os.write(self._tells, json.dumps(list(arguments)).encode() + b"\n")
        except BrokenPipeError:
            return None
        finally:
            os.close(self._tells)
        return self.process

    def end(self) -> None:
        """Of one that has not been taken."""
        os.close(self._tells)
        self.process.kill()


def _spawn(runtime_dir: Path, name: str, command: Sequence[str], *, stdin: int | None = None) -> int:
    """Its output goes to ``<name>.log``: a pipe would end the node together with the server."""
    log = runtime_dir / f"{name}.log"
    bound_log(log)
    flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW
    nothing = (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0)
    return os.posix_spawn(
        sys.executable,
        [sys.executable, "-m", *command],
        plain_environment(),
        file_actions=[
            nothing if stdin is None else (os.POSIX_SPAWN_DUP2, stdin, 0),
            (os.POSIX_SPAWN_OPEN, 1, str(log), flags, 0o600),
            (os.POSIX_SPAWN_DUP2, 1, 2),
            *((os.POSIX_SPAWN_CLOSE, handle) for handle in _inheritable()),
        ],
        setsid=True,
    )


def bound_log(log: Path) -> None:
    """Keeps the newest part of a log that has grown too long. Nodes append, so they go on writing at its end."""
    with contextlib.suppress(OSError):
        if log.stat().st_size <= LOG_BYTES:
            return
        with log.open("rb+") as file:
            file.seek(-LOG_BYTES // 2, os.SEEK_END)
            newest = file.read()
            file.truncate(0)
            file.seek(0)
            file.write(newest[newest.find(b"\n") + 1 :])


def _inheritable() -> list[int]:
    """Open files that a child would get. Zenoh's lock is one: held by a node, it would keep the next server out."""
    fds = []
    for fd in map(int, os.listdir("/proc/self/fd")):
        with contextlib.suppress(OSError):  # closed meanwhile
            if fd > 2 and os.get_inheritable(fd):
                fds.append(fd)
    return fds
