"""Whether a process still does its work: one that hangs is told from one that merely gets no processor time.

The guardian lives on this and little else: it imports nothing but the standard library's smallest.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

SILENT_S, HUNG_S, STARVED_S, START_S, BUSY_S = 1.0, 3.0, 15.0, 60.0, 180.0
"""Without a proof: said; given up; given up though it waits for a processor or a disk; given up before its first one,
while it loads what it needs; given up though it works hard."""
_WORKS, _WORKS_HARD = 0.1, 0.5
"""Processor time used while silent, as a share of that time: of one that hangs next to none."""
_ASLEEP_S = 1.0
"""An observer that has not looked for so long was itself stopped, and all others with it perhaps."""
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")


class Proven(Protocol):
    @property
    def pid(self) -> int: ...

    @property
    def proved_t_mono_s(self) -> float:
        """When it last proved that it does its work, on the clock that all processes here share."""
        ...


@dataclass(frozen=True, slots=True)
class Silence:
    """How long a process has proved nothing; ``is_hung``: waiting for it is in vain."""

    silent_s: float = 0.0
    is_hung: bool = False


class Liveness:
    """Of one process, looked at every moment by one observer on the clock of ``time.monotonic``."""

    def __init__(self, *, hung_s: float = HUNG_S, busy_s: float = BUSY_S, start_s: float = START_S) -> None:
        """``busy_s``: as ``hung_s``, of a node that works hard all the while; ``start_s``: until its first proof."""
        self._hung_s, self._busy_s, self._start_s = hung_s, busy_s, start_s
        self._pid, self._proofs, self._proved_s = 0, 0, 0.0
        self._cpu_s = self._looked_s = self._awake_s = 0.0

    def look(self, facts: Proven, now_s: float) -> Silence:
        if now_s - self._looked_s > _ASLEEP_S:
            self._awake_s = now_s
        self._looked_s = now_s
        if facts.pid != self._pid:
            self._pid, self._proofs, self._proved_s = facts.pid, 0, 0.0
        # Before its first proof is kept, the file's time is that of the wall clock, which proves nothing.
        if self._proved_s != facts.proved_t_mono_s <= now_s:
            self._proved_s, self._cpu_s = facts.proved_t_mono_s, _cpu_s(facts.pid)
            self._proofs += 1
        silent_s = now_s - max(self._proved_s, self._awake_s)
        if silent_s < min(SILENT_S, self._hung_s):
            return Silence()
        return Silence(silent_s, silent_s >= self._patience_s(silent_s))

    def _patience_s(self, silent_s: float) -> float:
        share = (_cpu_s(self._pid) - self._cpu_s) / silent_s
        busy_s = self._busy_s if share >= _WORKS_HARD else 0.0
        if self._proofs <= 1 and self._start_s > self._hung_s:  # the first one is that of its start
            return max(busy_s, self._start_s)
        if busy_s:
            return busy_s
        return STARVED_S if share >= _WORKS or _is_waiting(self._pid) else self._hung_s


def _cpu_s(pid: int) -> float:
    """Processor time of all its threads; 0 when the process is gone."""
    fields = _fields(Path(f"/proc/{pid}/stat"))
    return (int(fields[11]) + int(fields[12])) / _TICKS_PER_S if fields else 0.0


def _is_waiting(pid: int) -> bool:
    """Whether any of its threads could go on if it were given a processor, or what it asked of a disk."""
    threads = (_fields(path / "stat") for path in Path(f"/proc/{pid}/task").glob("*"))
    return any(fields and fields[0] in ("R", "D") for fields in threads)


def _fields(file: Path) -> list[str]:
    """From the state on, as ``man 5 proc`` lists them; empty when it is gone."""
    try:
        return file.read_text().rpartition(")")[2].split()
    except OSError:
        return []
