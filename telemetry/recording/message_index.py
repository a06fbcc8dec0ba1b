"""Where each message stands in its chunk: the records that follow every chunk of an MCAP file."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

_RECORD = struct.Struct("<BQHI")
_ENTRY = struct.Struct("<QQ")
_OPCODE = 7


def message_index(entries: Mapping[int, Sequence[tuple[int, int]]], offset: int) -> tuple[bytes, dict[int, int]]:
    """(time in ns, offset in the chunk) of the messages by channel -> records, and where each begins in the file.

    ``offset``: where the first of them will stand.
    """
    block, offsets = bytearray(), dict[int, int]()
    for channel, places in entries.items():
        offsets[channel] = offset + len(block)
        size = _ENTRY.size * len(places)
        block += _RECORD.pack(_OPCODE, 6 + size, channel, size)
        block += b"".join(_ENTRY.pack(*place) for place in places)
    return bytes(block), offsets
