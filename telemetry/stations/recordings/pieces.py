"""A file that comes in pieces over a line that others need more: put together in order, asked for no faster than it
bears.

Two things hold it back: a budget in bytes per second, and how long pieces take to come. Where they take clearly longer
than the quickest ones did, something queues up on the way, positions with it: fewer are under way from then on.
"""

from __future__ import annotations

import math
from collections import deque

from telemetry.errors import StationsError
from telemetry.stations.recordings.asked_and_given import PIECE_BYTES

LEAST_UNDER_WAY = 2
QUEUES_S, IN_A_ROW = 0.4, 6
"""Where so many pieces, one after the other, take so much longer than the quickest one, something queues up. A packet
that was lost holds up fewer."""
AGAIN_S = 3.0
"""A piece that has not come by then is asked for again."""
_UNASKED = 64
"""More than those that were asked for twice: nobody who answers sends so many."""


class Bucket:
    """A budget: what was not spent for a fifth of a second is gone."""

    def __init__(self, bytes_per_s: float) -> None:
        self.bytes_per_s = bytes_per_s
        self._there, self._at_s = 0.0, -math.inf

    def take(self, size: int, now_s: float) -> bool:
        most = max(PIECE_BYTES, 0.2 * self.bytes_per_s)
        self._there = min(most, self._there + self.bytes_per_s * max(0.0, min(1.0, now_s - self._at_s)))
        self._at_s = now_s
        if self._there < min(size, most):
            return False
        self._there -= size
        return True


class Pace:
    """How many pieces may be under way."""

    def __init__(self) -> None:
        self._window = float(LEAST_UNDER_WAY)
        self._took: deque[float] = deque(maxlen=IN_A_ROW)
        self._quickest_s = math.inf
        self._slowed_s = -math.inf

    def under_way(self, bytes_per_s: float) -> int:
        """``bytes_per_s``: the budget; what it carries in a second is enough for any line."""
        return max(LEAST_UNDER_WAY, math.floor(min(self._window, bytes_per_s / PIECE_BYTES)))

    def patience_s(self) -> float:
        return max(AGAIN_S, 3.0 * max(self._took, default=0.0))

    def came(self, asked_s: float, now_s: float) -> None:
        took_s = now_s - asked_s
        self._took.append(took_s)
        self._quickest_s = min(self._quickest_s, took_s)
        if len(self._took) == IN_A_ROW and min(self._took) > self._quickest_s + QUEUES_S:
            self.slower(asked_s, now_s)
        elif took_s <= self._quickest_s + QUEUES_S:
            self._window += 1.0 / self._window

    def slower(self, asked_s: float, now_s: float) -> None:
        """Once for all pieces that were under way together."""
        if asked_s >= self._slowed_s:
            self._slowed_s = now_s
            self._window = max(float(LEAST_UNDER_WAY), self._window / 2.0)


class Pieces:
    """Sans-IO. ``have``: bytes from the beginning that are there, a multiple of ``PIECE_BYTES`` or all of them."""

    def __init__(self, size: int, have: int) -> None:
        if not 0 <= have <= size or (have % PIECE_BYTES and have != size):
            raise ValueError(f"{have} of {size} bytes are no beginning in whole pieces")
        self.size, self.have = size, have
        self.pace = Pace()
        self._asked: dict[int, float] = {}
        self._twice: set[int] = set()
        self._early: dict[int, bytes] = {}
        self._repeats = self._unasked = 0

    @property
    def is_whole(self) -> bool:
        return self.have == self.size

    def due(self, bucket: Bucket, now_s: float, most: int) -> list[int]:
        """Offsets that are to be asked for now."""
        offsets = list[int]()
        patience_s = self.pace.patience_s()
        for offset, asked_s in list(self._asked.items()):
            if len(offsets) < most and now_s - asked_s > patience_s and bucket.take(PIECE_BYTES, now_s):
                self.pace.slower(asked_s, now_s)
                self._twice.add(offset)
                self._repeats += 1
                self._asked[offset] = now_s
                offsets.append(offset)
        window = self.pace.under_way(bucket.bytes_per_s)
        for offset in range(self.have, min(self.size, self.have + 4 * window * PIECE_BYTES), PIECE_BYTES):
            if len(self._asked) >= window or len(offsets) >= most:
                break
            if offset in self._asked or offset in self._early:
                continue
            if not bucket.take(self._length(offset), now_s):
                break
            self._asked[offset] = now_s
            offsets.append(offset)
        return offsets

    def forget_asked(self) -> None:
        """The way was cut: nothing of it comes any more, or it comes as a repetition."""
        self._repeats += len(self._asked)
        self._asked.clear()
        self._twice.clear()
        self.pace = Pace()

    def on_piece(self, offset: int, data: bytes, now_s: float) -> bytes:
        """What is to be written behind ``have`` as it was before. Raises StationsError for what no honest one sends."""
        if offset >= self.size or offset % PIECE_BYTES:
            raise StationsError(f"A piece came for byte {offset}, where none of its {self.size} bytes begins.")
        if len(data) != self._length(offset):
            raise StationsError(f"A piece of {len(data)} bytes came where {self._length(offset)} were asked for.")
        asked_s = self._asked.pop(offset, None)
        if asked_s is None:
            self._unasked += 1
            if self._unasked > self._repeats + _UNASKED:
                raise StationsError("Pieces come without end that nobody asked for.")
            return b""
        if offset not in self._twice:  # of one that was asked for twice it is not known which one came
            self.pace.came(asked_s, now_s)
        self._twice.discard(offset)
        self._early[offset] = data
        ready = bytearray()
        while (following := self._early.pop(self.have + len(ready), None)) is not None:
            ready += following
        self.have += len(ready)
        return bytes(ready)

    def _length(self, offset: int) -> int:
        return min(PIECE_BYTES, self.size - offset)
