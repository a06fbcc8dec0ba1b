"""How much room there is for recordings, and from when on it is too little."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from telemetry.errors import RecordingFullError

_MOST_RESERVED_BYTES = 16 * 1024 * 1024
_RESERVED_SHARE = 50
_WARN_S = 15 * 60.0
WARN_BYTES = 200 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class Space:
    free: int
    total: int

    @property
    def reserve(self) -> int:
        """Kept free so that a recording can be finished with its index and the computer goes on working."""
        return min(_MOST_RESERVED_BYTES, self.total // _RESERVED_SHARE)

    @property
    def exhausted(self) -> bool:
        return self.free < self.reserve

    @property
    def enough_to_begin(self) -> bool:
        """More than ``exhausted`` asks for, or recordings would begin and end all the time."""
        return self.free >= 2 * self.reserve


Measure = Callable[[Path], Space]


def space_at(folder: Path) -> Space:
    """Raises OSError when the folder is gone."""
    usage = shutil.disk_usage(folder)
    return Space(usage.free, usage.total)


def full(where: str) -> RecordingFullError:
    return RecordingFullError(
        "The disk is nearly full: recording has stopped.",
        where=where,
        advice="Delete old recordings; recording then goes on by itself.",
    )


def running_out(space: Space, rate_bytes_s: float, where: str) -> RecordingFullError | None:
    """What is said before the disk is full."""
    left_s = (space.free - space.reserve) / max(rate_bytes_s, 1.0)
    if space.free - space.reserve > WARN_BYTES and left_s > _WARN_S:
        return None
    minutes = max(0, int(left_s / 60))
    what = f"Only {space.free / 1e6:.0f} MB are left on the disk, enough to record for {minutes} minutes."
    if minutes > 120:
        what = f"Only {space.free / 1e6:.0f} MB are left on the disk."
    return RecordingFullError(what, where=where, advice="Delete old recordings before the flight.")
