"""Messages between host and board, sans-IO: a payload with start, endpoint, length and end, or a status word.

| bytes | payload | status |
|---|---|---|
| 0 | 0x5A | 0x5B |
| 1 | endpoint, 0 for the protocol itself | endpoint |
| 2-3 | length of the payload | 0: done; else why not |
| then | the payload, 0xE0DB | |

Numbers are little-endian. Each request is answered by payloads, if any, and one status; the board says nothing of its
own accord. There is no checksum but USB's own: what guards against lost bytes is the end mark in its place.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

PAYLOAD, STATUS = 0x5A, 0x5B
END = b"\xdb\xe0"
LONGEST_BYTES = 16_384
"""A frame of 16 chirps of 64 samples has 6,162."""
_HEAD_BYTES = 4


class OutOfStepError(Exception):
    """What came begins or ends nowhere: bytes were lost, or it is another protocol."""


@dataclass(frozen=True, slots=True)
class Payload:
    endpoint: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Status:
    """0: done."""

    endpoint: int
    code: int


Message = Payload | Status


def encode(endpoint: int, payload: bytes) -> bytes:
    return struct.pack("<BBH", PAYLOAD, endpoint, len(payload)) + payload + END


class MessageStream:
    """Bytes in as they come, messages out."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[Message]:
        """Raises OutOfStepError at the first byte that is not in its place; then ``reset`` once the line is quiet."""
        self._buffer += data
        messages: list[Message] = []
        while (message := self._next()) is not None:
            messages.append(message)
        return messages

    def reset(self) -> int:
        """Forgets what waits for its rest; how many bytes that were."""
        dropped = len(self._buffer)
        self._buffer.clear()
        return dropped

    def _next(self) -> Message | None:
        if not self._buffer:
            return None
        if self._buffer[0] not in (PAYLOAD, STATUS):
            raise OutOfStepError
        if len(self._buffer) < _HEAD_BYTES:
            return None
        kind, endpoint, number = struct.unpack_from("<BBH", self._buffer)
        if kind == STATUS:
            self._take(_HEAD_BYTES)
            return Status(endpoint, number)
        if number > LONGEST_BYTES:
            raise OutOfStepError
        whole = _HEAD_BYTES + number + len(END)
        if len(self._buffer) < whole:
            return None
        taken = self._take(whole)
        if not taken.endswith(END):
            self._buffer[:0] = taken
            raise OutOfStepError
        return Payload(endpoint, taken[_HEAD_BYTES : -len(END)])

    def _take(self, count: int) -> bytes:
        taken = bytes(self._buffer[:count])
        del self._buffer[:count]
        return taken
