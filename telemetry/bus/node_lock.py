"""The lock file of a node: held while the node lives, and saying who it is."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import json
import os
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Self

from planning import __version__
from telemetry.bus.liveness import SILENT_S
from telemetry.errors import BusError

_SUFFIX = ".lock"
_PATIENCE_S = 1.0
"""Somebody may just be looking whether the lock is held, or a node that ends may still hold it."""


@dataclass(frozen=True, slots=True)
class NodeFacts:
    """What a running node says of itself."""

    name: str
    pid: int
    arguments: tuple[str, ...]
    version: str
    replaceable: bool
    """May be ended without asking anybody. A link node is not, while its vehicle is armed."""
    proved_t_mono_s: float = field(default=0.0, compare=False)
    """When it last proved that it does its work, on the clock that all processes here share."""


def running_node(runtime_dir: Path, name: str) -> NodeFacts | None:
    """The facts of the node, or None when no process holds its lock."""
    try:
        fd = os.open(runtime_dir / f"{name}{_SUFFIX}", os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        if _take(fd, fcntl.LOCK_SH):
            return None
        return _read(fd)
    finally:
        os.close(fd)


def running_nodes(runtime_dir: Path) -> list[NodeFacts]:
    names = (path.name.removesuffix(_SUFFIX) for path in sorted(runtime_dir.glob(f"*{_SUFFIX}")))
    found = (running_node(runtime_dir, name) for name in names if not name.endswith(".sock"))
    return [facts for facts in found if facts is not None]


class NodeLock:
    """Context manager that makes this process the one node of its name; BusError when there is another."""

    def __init__(self, runtime_dir: Path, name: str, arguments: Sequence[str]) -> None:
        self._path = runtime_dir / f"{name}{_SUFFIX}"
        # A link node that has not heard of its vehicle yet may have an armed one.
        self._facts = NodeFacts(name, os.getpid(), tuple(arguments), __version__, replaceable=name != "link")
        self._fd = -1
        self._proved_ns = 0
        self._proved = threading.Event()
        self._keeper = threading.Thread(target=self._keep_proof, name="proof", daemon=True)

    def __enter__(self) -> Self:
        self._fd = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        deadline_s = time.monotonic() + _PATIENCE_S
        while not _take(self._fd, fcntl.LOCK_EX):
            if time.monotonic() > deadline_s:
                raise self._taken()
            time.sleep(0.02)
        self._write()
        self._keeper.start()
        return self

    def __exit__(self, *_exc: object) -> None:
        # The file stays: whoever opened it before it was removed would hold a lock that nobody sees.
        fd, self._fd = self._fd, -1
        self._proved.set()
        self._keeper.join(_PATIENCE_S)
        os.close(fd)

    def prove_alive(self) -> None:
        """Called by the node's own work, twice a second; waits for no disk."""
        self._proved_ns = time.monotonic_ns()
        self._proved.set()

    def _keep_proof(self) -> None:
        """In a thread of its own. Kept as the file's time: there is nothing to write or tear."""
        while self._proved.wait():
            self._proved.clear()
            if self._fd < 0:
                return
            with contextlib.suppress(OSError):  # of a disk that takes none: ``silence_counts`` knows
                os.utime(self._fd, ns=(self._proved_ns, self._proved_ns))

    def set_replaceable(self, replaceable: bool) -> None:
        if replaceable != self._facts.replaceable:
            self._facts = replace(self._facts, replaceable=replaceable)
            self._write()

    def _taken(self) -> BusError:
        other = _read(self._fd)
        os.close(self._fd)
        whom = f" (process {other.pid})" if other else ""
        return BusError(
            f"The {self._facts.name} node is running already{whom}.",
            where=str(self._path.parent),
            advice="End it first, or choose another runtime directory.",
        )

    def _write(self) -> None:
        text = json.dumps(asdict(self._facts)).encode() + b"\n"
        os.pwrite(self._fd, text, 0)
        os.ftruncate(self._fd, len(text))
        self.prove_alive()


async def silence_counts(runtime_dir: Path) -> bool:
    """Whether the disk takes proofs, and soon: of one that is read-only or broken no silence tells anything."""
    with contextlib.suppress(TimeoutError, OSError):
        await asyncio.wait_for(asyncio.to_thread(os.utime, runtime_dir), SILENT_S)
        return True
    return False


def _take(fd: int, kind: int) -> bool:
    try:
        fcntl.flock(fd, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _read(fd: int) -> NodeFacts | None:
    """None while the holder is writing, or has not yet written."""
    try:
        found = json.loads(os.pread(fd, 65536, 0))
        return NodeFacts(
            name=str(found["name"]),
            pid=int(found["pid"]),
            arguments=tuple(str(argument) for argument in found["arguments"]),
            version=str(found["version"]),
            replaceable=bool(found["replaceable"]),
            proved_t_mono_s=os.fstat(fd).st_mtime_ns / 1e9,
        )
    except (ValueError, KeyError, TypeError):
        return None
