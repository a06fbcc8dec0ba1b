"""The data port's stream, sans-IO: bytes in as they come, frames out; what is none of them is counted and skipped."""

from __future__ import annotations

from dataclasses import dataclass

from telemetry.sensors.ti_mmwave.ti_frame import MAGIC, DamagedPacketError, TiFrame, decode_packet, packet_bytes

MOST_SKIPPED = 20
"""Numbers that go on farther than this, or backwards, are in doubt: one flipped bit does as much."""
RESTART_GAP = 10_000
"""Jumps farther than this have begun anew: nothing was lost."""
_START_BYTES = 16
"""Magic word, version and total length."""


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


@dataclass(slots=True)
class TiCounts:
    """Since the stream began."""

    bytes: int = 0
    bad_bytes: int = 0
    """Of no packet that could be read."""
    frames: int = 0
    lost_packets: int = 0
    """Gaps in the frames' numbers."""
    damaged_packets: int = 0
    """Cut short, or not what their own lengths say."""
    implausible_lengths: int = 0
    """Magic words followed by a length or a version that no packet has."""
    implausible_points: int = 0
    """Left out: no number, or farther or faster than the radar can see."""


class TiStream:
    """Finds packets by their magic word, and finds the next one again after anything that is none.

    The protocol has no checksum. What guards against damage: the packet's length, a walk over its parts that must
    come out even, and a magic word inside a packet, which says that its end was lost.
    """

    def __init__(self, *, velocity_cell_m_s: float = float("nan")) -> None:
        """``velocity_cell_m_s``: SDK 2 tells speeds as cells; without it they come as NaN."""
        self.counts = TiCounts()
        self.bytes_since_frame = 0
        """Much of it without a frame: this is no such stream, or the baud rate is wrong."""
        self._velocity_cell_m_s = velocity_cell_m_s
        self._buffer = bytearray()
        self._numbering = Numbering()

    def feed(self, data: bytes) -> list[TiFrame]:
        self.counts.bytes += len(data)
        self.bytes_since_frame += len(data)
        self._buffer += data
        frames: list[TiFrame] = []
        while (packet := self._next_packet()) is not None:
            frame = self._decode(packet)
            if frame is not None:
                frames += self._numbering.take(frame)
        self.counts.lost_packets += sum(frame.lost_before for frame in frames)
        return frames

    def reset(self) -> list[TiFrame]:
        """The line was interrupted, or has ended: what waits for its rest will not get it.

        Returns the frame that was held back since its number was in doubt, if there is one.
        """
        self._drop(len(self._buffer))
        return self._numbering.end()

    def _next_packet(self) -> bytes | None:
        """A whole packet by its length, still at the buffer's head; None when more bytes are needed."""
        while True:
            start = self._buffer.find(MAGIC)
            if start < 0:
                self._drop(max(0, len(self._buffer) - len(MAGIC) + 1))
                return None
            self._drop(start)
            if len(self._buffer) < _START_BYTES:
                return None
            length = packet_bytes(self._buffer)
            if length is None:
                self.counts.implausible_lengths += 1
                self._drop(len(MAGIC))
                continue
            another = self._buffer.find(MAGIC, len(MAGIC), length + len(MAGIC) - 1)
            if 0 <= another < length:
                self.counts.damaged_packets += 1
                self._drop(another)
                continue
            return bytes(self._buffer[:length]) if self._is_complete(length) else None

    def _is_complete(self, length: int) -> bool:
        """Not while its last bytes may begin a magic word: the packet was cut then, and that is the next one."""
        behind = len(self._buffer) - length
        if behind < 0:
            return False
        return not any(
            self._buffer[length - begun :] == MAGIC[: begun + behind] for begun in range(1, len(MAGIC) - behind)
        )

    def _decode(self, packet: bytes) -> TiFrame | None:
        try:
            frame, left_out = decode_packet(packet, velocity_cell_m_s=self._velocity_cell_m_s)
        except DamagedPacketError:
            self.counts.damaged_packets += 1
            self._drop(len(MAGIC))
            return None
        del self._buffer[: len(packet)]
        self.bytes_since_frame = len(self._buffer)
        self.counts.frames += 1
        self.counts.implausible_points += left_out
        return frame

    def _drop(self, count: int) -> None:
        del self._buffer[:count]
        self.counts.bad_bytes += count
