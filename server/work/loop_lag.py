"""How late the server's loop is: what is sent to pages and nodes waits as long as whatever holds it up."""

from __future__ import annotations

import asyncio
import logging
import math
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from types import FrameType

log = logging.getLogger("hedgehop.loop")

TICK_S = 0.02
LONG_S = 0.1
WINDOW_S = 600.0
_LOG_EVERY_S = 10.0
_WAITING = "nothing of the loop's own: the processor, or a computing thread, held it up"


@dataclass(frozen=True, slots=True)
class Lag:
    p99_s: float
    """Of the last ten minutes at most."""
    longest_s: float
    longest_utc: str
    since_utc: str
    longest_work_s: float
    """Of the processor's time, that the loop's own thread took between two ticks: what the loop owes to itself alone,
    however busy the machine is."""


class LoopLag:
    """Measures the loop that ``run`` runs on. Another thread looks what the loop is at while it is late."""

    def __init__(
        self, *, now_s: Callable[[], float] = time.monotonic, worked_s: Callable[[], float] = time.thread_time
    ) -> None:
        self._now_s, self._worked_s = now_s, worked_s
        self._late_s: deque[float] = deque(maxlen=round(WINDOW_S / TICK_S))
        self._longest_s, self._longest_utc, self._since_utc = 0.0, "", _utc()
        self._due_s = now_s() + TICK_S
        self.was_at = ""
        """What the loop was seen at since it is late; empty while it is not, and where it was not seen at anything."""
        self._logged_s = -_LOG_EVERY_S
        self._work_s, self._longest_work_s = worked_s(), 0.0

    @property
    def lag(self) -> Lag:
        late_s = sorted(self._late_s)
        p99_s = late_s[len(late_s) * 99 // 100] if late_s else 0.0
        return Lag(p99_s, self._longest_s, self._longest_utc, self._since_utc, self._longest_work_s)

    async def run(self) -> None:
        """Until cancelled."""
        ended = threading.Event()
        watch = threading.Thread(
            target=self._watch, args=(threading.get_ident(), ended), name="watches the loop", daemon=True
        )
        self._due_s = math.inf  # what its start takes is not the loop's
        watch.start()
        self._due_s, self._work_s = self._now_s() + TICK_S, self._worked_s()
        try:
            while True:
                await asyncio.sleep(max(0.0, self._due_s - self._now_s()))
                self.note(self._now_s())
        finally:
            ended.set()

    def note(self, now_s: float) -> None:
        """The loop has come round, that it should have done at the time that was due."""
        late_s = max(0.0, now_s - self._due_s)
        self._due_s = now_s + TICK_S
        self._late_s.append(late_s)
        before_s, self._work_s = self._work_s, self._worked_s()
        self._longest_work_s = max(self._longest_work_s, self._work_s - before_s)
        if late_s > self._longest_s:
            self._longest_s, self._longest_utc = late_s, _utc()
        if late_s > LONG_S and now_s - self._logged_s > _LOG_EVERY_S:
            self._logged_s = now_s
            log.warning("The server's loop was %.0f ms late. It was at: %s.", 1000 * late_s, self.was_at or _WAITING)
        self.was_at = ""

    def _watch(self, loop_thread: int, ended: threading.Event) -> None:
        while not ended.wait(LONG_S / 2):
            if self._now_s() - self._due_s > LONG_S / 2:
                frame = sys._current_frames().get(loop_thread)
                self.was_at = self.was_at or (place_of(frame) if frame else "")


def place_of(frame: FrameType) -> str:
    """The innermost three calls; empty where the loop waits for something to do."""
    calls = traceback.extract_stack(frame)
    if calls[-1].name == "select":
        return ""
    return ", called by ".join(f"{call.name} ({call.filename}:{call.lineno})" for call in reversed(calls[-3:]))


def _utc() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
