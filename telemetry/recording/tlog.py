"""Telemetry logs of other ground stations: eight bytes of time, one MAVLink frame, and so on, with rubbish between.

The times are microseconds since 1970, big-endian. A record counts when its frame's checksum is right; otherwise the
next one is looked for byte by byte, so that a bad span costs nothing but itself.
"""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.texts.event_messages import KNOWN_MESSAGES

Data = bytes | mmap.mmap
TIME_BYTES = 8
_V1, _V2 = mavlink.PROTOCOL_MARKER_V1, mavlink.PROTOCOL_MARKER_V2
_MARKER = re.compile(b"[\xfd\xfe]")
_SIGNATURE_BYTES = 13
CUT_SHORT = "The file ends in the middle of a message."
_LATEST_US = 4_102_444_800_000_000
"""The year 2100; clocks that were never set begin at 1970, so there is no earliest time."""
_CRC_EXTRA = {number: message.crc_extra for number, message in KNOWN_MESSAGES.items()}


class LogFrame(NamedTuple):
    """One MAVLink frame of a log with its place in the file."""

    t_utc_s: float
    message_id: int
    system_id: int
    component_id: int
    frame: bytes
    offset: int


@dataclass(slots=True)
class Damage:
    """What was skipped; grows while frames are read."""

    spans: int = 0
    """Bad stretches between good records."""
    bytes: int = 0
    cut_short: bool = False
    """The file does not end with a whole record."""

    def words(self, size: int) -> list[str]:
        """Sentences, of a file of ``size`` bytes."""
        faults = []
        if self.spans:
            lost = 100.0 * self.bytes / size
            stretches = "1 damaged stretch was" if self.spans == 1 else f"{self.spans} damaged stretches were"
            faults.append(f"{stretches} skipped, {lost:.1f} % of the file.")
        if self.cut_short:
            faults.append(CUT_SHORT)
        return faults


def tlog_frames(data: Data, damage: Damage | None = None, *, start: int = 0) -> Iterator[LogFrame]:
    """The good frames of a log from byte ``start`` on, in the order of the file."""
    damage = Damage() if damage is None else damage
    at, size, in_step = start, len(data), False
    while at < size:
        found = _record(data, at, in_step)
        if found is None:
            after = _next_record(data, at + 1)
            damage.cut_short = after == size
            damage.spans += after < size
            damage.bytes += after - at
            at, in_step = after, False
            continue
        yield found
        at, in_step = at + TIME_BYTES + len(found.frame), True


def _next_record(data: Data, start: int) -> int:
    """Where the next good record begins; the end of the data when there is none."""
    for marker in _MARKER.finditer(data, start + TIME_BYTES):
        if _record(data, marker.start() - TIME_BYTES, in_step=False) is not None:
            return marker.start() - TIME_BYTES
    return len(data)


def _record(data: Data, at: int, in_step: bool) -> LogFrame | None:
    """The record at ``at`` if it is a whole one whose checksum and time can be believed.

    Messages of unknown type, whose checksum cannot be computed, are believed only directly behind a good record.
    """
    frame = frame_at(data, at + TIME_BYTES)
    if frame is None:
        return None
    t_us = int.from_bytes(data[at : at + TIME_BYTES], "big")
    message_id, system, component = frame_address(frame)
    known = message_id in _CRC_EXTRA or (in_step and _continues(data, at + TIME_BYTES + len(frame)))
    if t_us > _LATEST_US or not known:
        return None
    return LogFrame(t_us / 1e6, message_id, system, component, frame, at)


def frame_at(data: Data, at: int) -> bytes | None:
    """The MAVLink frame that begins at ``at``; None unless it is whole and its checksum right.

    The checksum of a message this dialect does not know cannot be computed: such a frame passes.
    """
    end = _frame_end(data, at)
    if end is None:
        return None
    frame = data[at:end]
    extra = _CRC_EXTRA.get(frame_address(frame)[0])
    if extra is None:
        return frame
    stop = frame[1] + (10 if frame[0] == _V2 else 6)
    right = mcrf4xx(frame[1:stop] + bytes((extra,))) == frame[stop] | frame[stop + 1] << 8
    return frame if right else None


def frame_address(frame: bytes) -> tuple[int, int, int]:
    """Message id, system id and component id of a whole frame."""
    if frame[0] == _V2:
        return frame[7] | frame[8] << 8 | frame[9] << 16, frame[5], frame[6]
    return frame[5], frame[3], frame[4]


def _frame_end(data: Data, at: int) -> int | None:
    size = len(data)
    if at + 8 > size:
        return None
    if data[at] == _V1:
        end = at + 8 + data[at + 1]
    elif data[at] == _V2 and at + 12 <= size:
        end = at + 12 + data[at + 1] + (_SIGNATURE_BYTES if data[at + 2] & mavlink.MAVLINK_IFLAG_SIGNED else 0)
    else:
        return None
    return end if end <= size else None


def _continues(data: Data, at: int) -> bool:
    """Whether another record, or the end of the file, stands at ``at``."""
    marker = at + TIME_BYTES
    return at == len(data) or (marker < len(data) and data[marker] in (_V1, _V2))
