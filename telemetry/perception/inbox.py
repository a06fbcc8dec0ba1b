"""Between the event loop, which always reads the bus, and the thread that works on frames."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

HOLD_S = 0.06
"""A frame waits so long for a pose that is newer than itself: poses come 20 times a second, through a radio."""
_MOST = 5000


class Inbox:
    """Messages in order, and frames of which the newest count: what finds no room pushes out the oldest."""

    def __init__(self, *, backlog: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._ready = threading.Condition()
        self._messages: deque[tuple[str, Any]] = deque(maxlen=_MOST)
        self._frames: deque[tuple[float, Any]] = deque()
        self._backlog = backlog
        self._skipped = 0
        self._closed = False

    def put(self, kind: str, message: Any) -> None:
        with self._ready:
            self._messages.append((kind, message))
            self._ready.notify()

    def put_frame(self, frame: Any) -> None:
        with self._ready:
            self._frames.append((self._clock(), frame))
            while len(self._frames) > self._backlog:
                self._frames.popleft()
                self._skipped += 1
            self._ready.notify()

    def close(self) -> None:
        with self._ready:
            self._closed = True
            self._ready.notify()

    @property
    def closed(self) -> bool:
        return self._closed

    def wait(self, until_s: float) -> None:
        """Until there is something, or that time has come."""
        with self._ready:
            if not self._messages and not self._closed:
                self._ready.wait(max(0.0, min(until_s, self._frame_due_s()) - self._clock()))

    def messages(self) -> list[tuple[str, Any]]:
        with self._ready:
            taken = list(self._messages)
            self._messages.clear()
            return taken

    def frame(self, pose_t_mono_s: float) -> Any | None:
        """The next frame, if poses are known up to its time or it has waited long enough for them."""
        with self._ready:
            if not self._frames:
                return None
            came_s, frame = self._frames[0]
            if not frame.t_mono_s <= pose_t_mono_s and self._clock() < came_s + HOLD_S:
                return None
            self._frames.popleft()
            return frame

    def skipped(self) -> int:
        """Frames that were pushed out since this was last asked."""
        with self._ready:
            count, self._skipped = self._skipped, 0
            return count

    def _frame_due_s(self) -> float:
        return self._frames[0][0] + HOLD_S if self._frames else math.inf
