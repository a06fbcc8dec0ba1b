"""Frames counted by their numbers, which no checksum guards: a far jump is believed once the next frame goes on."""

from __future__ import annotations

from telemetry.sensors.ti_mmwave.ti_frame import TiFrame

MOST_SKIPPED = 20
"""Numbers that go on farther than this, or backwards, are in doubt: one flipped bit does as much."""
RESTART_GAP = 10_000
"""Jumps farther than this have begun anew: nothing was lost."""


class Numbering:
    """Holds a frame of doubtful number back until the next one comes, and says of each what was lost before it."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._doubtful: TiFrame | None = None

    def take(self, frame: TiFrame) -> list[TiFrame]:
        """Those that are ready now, in their order."""
        ready = self._settled(frame.number)
        if self._last is not None and not _goes_on(self._last, frame.number):
            self._doubtful = frame
            return ready
        self._believe(frame)
        return [*ready, frame]

    def end(self) -> list[TiFrame]:
        """No more will come, or others: the one that is held back, and the count begins anew."""
        held = [] if self._doubtful is None else [self._doubtful]
        self._last = self._doubtful = None
        return held

    def _settled(self, following: int) -> list[TiFrame]:
        frame, self._doubtful = self._doubtful, None
        if frame is None:
            return []
        if _goes_on(frame.number, following):
            self._believe(frame)
        elif self._last is not None:
            self._last += 1  # the number was damaged: it stands for the one that was due
        return [frame]

    def _believe(self, frame: TiFrame) -> None:
        """Several packets may share a number, told apart by their sub-frames."""
        if self._last is not None and 1 < frame.number - self._last < RESTART_GAP:
            frame.lost_before = frame.number - self._last - 1
        self._last = frame.number


def _goes_on(number: int, following: int) -> bool:
    return 0 <= following - number <= MOST_SKIPPED
