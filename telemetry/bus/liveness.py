"""Whether a node still does its work: one that hangs is told from one that merely gets no processor time."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from telemetry.bus.node_lock import NodeFacts

SILENT_S, HUNG_S, BUSY_S, STARVED_S = 1.0, 3.0, 180.0, 15.0
"""Without a proof: said; given up; given up though it works hard; given up though it waits for a processor or disk."""
_ASLEEP_S = 1.0
"""An observer that has not looked for so long was itself stopped, and all others with it perhaps."""
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, slots=True)
class Silence:
    """How long a node has proved nothing; ``is_hung``: waiting for it is in vain."""

    silent_s: float = 0.0
    is_hung: bool = False


class Liveness:
    """Of one node, looked at every moment by one observer on the clock of ``time.monotonic``."""

    def __init__(self, *, hung_s: float = HUNG_S, busy_s: float = BUSY_S) -> None:
        """``busy_s``: as ``hung_s``, of a node that uses a processor all the while."""
        self._hung_s, self._busy_s = hung_s, busy_s
        self._proof = (0, 0.0)
        self._cpu_s = self._looked_s = self._awake_s = 0.0

    def look(self, facts: NodeFacts, now_s: float) -> Silence:
        if now_s - self._looked_s > _ASLEEP_S:
            self._awake_s = now_s
        self._looked_s = now_s
        proof = (facts.pid, facts.proved_t_mono_s)
        if proof != self._proof:
            self._proof, self._cpu_s = proof, _state_of(facts.pid)[1]
        silent_s = now_s - max(facts.proved_t_mono_s, self._awake_s)
        if silent_s < min(SILENT_S, self._hung_s):
            return Silence()
        state, cpu_s = _state_of(facts.pid)
        is_busy = cpu_s - self._cpu_s >= 0.5 * silent_s
        patience_s = self._busy_s if is_busy else STARVED_S if state in ("R", "D") else self._hung_s
        return Silence(silent_s, silent_s >= patience_s)


def _state_of(pid: int) -> tuple[str, float]:
    """The main thread's state as ``ps`` shows it, and the processor time of all threads; unknown: asleep, none."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return "S", 0.0
    return fields[0], (int(fields[11]) + int(fields[12])) / _TICKS_PER_S
