"""From bytes to messages and back. Nothing genuine is lost among noise, text and frames of other dialects.

pymavlink's own parser believes the length that a stray start byte seems to announce and swallows the genuine frames
behind it; here a frame that fails its checksum costs one byte, and the search goes on behind that byte.
"""

from __future__ import annotations

import re

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Message
from telemetry.mavlink.texts.event_messages import KNOWN_MESSAGES

V1, V2 = mavlink.PROTOCOL_MARKER_V1, mavlink.PROTOCOL_MARKER_V2
_MARKER = re.compile(b"[%c%c]" % (V1, V2))
_HEADER = {V1: 6, V2: 10}
_SIGNED = mavlink.MAVLINK_IFLAG_SIGNED
_SIGNATURE_BYTES = 13
_CHECKSUM_BYTES = 2


class Parser:
    """Of one sender. ``datagrams``: what one datagram leaves over is tried once with the next, and never delays it."""

    def __init__(self, *, datagrams: bool) -> None:
        self._datagrams = datagrams
        self._decoder = mavlink.MAVLink(None)
        self._left = b""
        self.bad_bytes = 0

    def feed(self, data: bytes) -> list[Message]:
        """The messages that are complete now, in order."""
        if not self._left:
            return self._scan(data)
        joined, left = self._left + data, self._left
        self._left = b""
        if self._datagrams and self._message_at(joined, 0)[1] <= len(left):
            self.bad_bytes += len(left)
            return self._scan(data)
        return self._scan(joined)

    def _scan(self, data: bytes) -> list[Message]:
        found: list[Message] = []
        at = 0
        while at < len(data):
            start = _next_marker(data, at)
            self.bad_bytes += start - at
            message, length = self._message_at(data, start)
            if message is not None:
                found.append(message)
                at = start + length
            elif length:
                self.bad_bytes += length
                at = start + length
            else:
                self._left = data[start:]
                break
        return found

    def _message_at(self, data: bytes, start: int) -> tuple[Message | None, int]:
        """(message, its bytes); (None, 1) when none begins here; (None, 0) when more bytes are needed to tell."""
        if start >= len(data):
            return None, 0
        header = _HEADER.get(data[start])
        if header is None:
            return None, 1
        if len(data) < start + header:
            return None, 0
        length = _frame_length(data, start, header)
        if length is None:
            return None, 1
        if len(data) < start + length:
            return None, 0
        try:
            message = self._decoder.decode(bytearray(data[start : start + length]))
        except mavlink.MAVError:
            return None, 1
        return message, length


def _next_marker(data: bytes, at: int) -> int:
    found = _MARKER.search(data, at)
    return found.start() if found else len(data)


def _frame_length(data: bytes, start: int, header: int) -> int | None:
    """None: this header is of no message that is known here, so the start byte was not one."""
    length = header + data[start + 1] + _CHECKSUM_BYTES
    if header == _HEADER[V1]:
        return length if data[start + 5] in KNOWN_MESSAGES else None
    flags = data[start + 2]
    if flags & ~_SIGNED or int.from_bytes(data[start + 7 : start + 10], "little") not in KNOWN_MESSAGES:
        return None
    return length + (_SIGNATURE_BYTES if flags & _SIGNED else 0)


class Packer:
    """Frames of this ground station, numbered in sequence."""

    def __init__(self, system: int = 255, component: int = mavlink.MAV_COMP_ID_MISSIONPLANNER) -> None:
        self._encoder = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)

    def pack(self, message: Message) -> bytes:
        frame = bytes(message.pack(self._encoder))
        self._encoder.seq = (self._encoder.seq + 1) % 256
        return frame
