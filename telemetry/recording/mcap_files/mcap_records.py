"""The records of an MCAP file, found one behind the other; damage is told by what comes next to make no sense."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from io import BytesIO
from typing import NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError

from telemetry.recording.tlog import Data

_RECORD = struct.Struct("<BQ")
RECORD_HEAD_BYTES = _RECORD.size
BROKEN = (McapError, struct.error, ValueError, OverflowError, MemoryError, zstandard.ZstdError)
"""What reading damaged records raises."""


class Record(NamedTuple):
    opcode: int
    offset: int
    start: int
    """Where the content begins."""
    end: int


def records(data: Data, start: int, stop: int) -> Iterator[Record]:
    """All whole records of ``data[start:stop]``."""
    at = start
    while at + _RECORD.size <= stop:
        opcode, length = _RECORD.unpack_from(data, at)
        content = at + _RECORD.size
        if opcode == 0 or length > stop - content:
            return
        yield Record(opcode, at, content, content + length)
        at = content + length


def record_at(data: Data, at: int, stop: int) -> Record:
    """The whole record that begins there; ValueError when there is none."""
    for record in records(data, at, stop):
        return record
    raise ValueError("no record where one should be")


def stream_of(data: Data, record: Record) -> ReadDataStream:
    """For the library's readers of single records: the content, and nothing behind it."""
    return ReadDataStream(BytesIO(data[record.start : record.end]))
