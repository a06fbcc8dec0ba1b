"""Records of an MCAP file, found one behind the other, and its chunks: compressed messages, each with a checksum."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from typing import NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from telemetry.recording.mcap_files.closing import ChunkPlace
from telemetry.recording.tlog import Data

_RECORD = struct.Struct("<BQ")
RECORD_HEAD_BYTES = _RECORD.size
BROKEN = (McapError, struct.error, ValueError, OverflowError, MemoryError, zstandard.ZstdError)
"""What reading damaged records raises."""
_CHUNK = struct.Struct("<QQQI")
_MESSAGE = struct.Struct("<HIQQ")
_LARGEST_CHUNK_BYTES = 256 * 1024 * 1024
_INDEX_RECORD = struct.Struct("<BQHI")
_INDEX_ENTRY = struct.Struct("<QQ")
_INDEX_OPCODE = 7


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


class Message(NamedTuple):
    channel: int
    t_ns: int
    own_ns: int
    data: bytes
    offset: int
    """Of its record in the chunk."""


def chunk_place(data: Data, record: Record) -> ChunkPlace:
    start_ns, end_ns, size, _ = _CHUNK.unpack_from(data, record.start)
    compression, _, packed = _chunk_data(data, record)
    length = record.end - record.offset
    return ChunkPlace(record.offset, length, start_ns, end_ns, {}, 0, compression, packed, size)


def _chunk_data(data: Data, record: Record) -> tuple[str, int, int]:
    """Compression, where the packed bytes begin, and how many they are."""
    at = record.start + _CHUNK.size
    (name_length,) = struct.unpack_from("<I", data, at)
    compression = data[at + 4 : at + 4 + min(name_length, 16)].decode()
    at += 4 + name_length
    (packed,) = struct.unpack_from("<Q", data, at)
    if at + 8 + packed > record.end:
        raise ValueError("a chunk that is longer than its record")
    return compression, at + 8, packed


def chunk_content(data: Data, chunk: ChunkPlace) -> bytes:
    """The unpacked records of a chunk. Raises what ``BROKEN`` lists when it is damaged."""
    record = record_at(data, chunk.offset, len(data))
    _, _, size, crc = _CHUNK.unpack_from(data, record.start)
    compression, at, packed = _chunk_data(data, record)
    content = data[at : at + packed]
    if size > _LARGEST_CHUNK_BYTES:
        raise ValueError("a chunk larger than any that is written")
    if compression == "zstd":
        if zstandard.frame_content_size(content) != size:
            raise ValueError("a chunk that unpacks to another size than it says")
        content = zstandard.ZstdDecompressor().decompress(content)
    elif compression:
        raise ValueError(f"a compression that is not read: {compression}")
    if len(content) != size or (crc and zlib.crc32(content) != crc):
        raise ValueError("a damaged chunk")
    return content


def messages(content: bytes) -> Iterator[Message]:
    """The messages of an unpacked chunk in the order of writing."""
    for record in records(content, 0, len(content)):
        if record.opcode == Opcode.MESSAGE:
            channel, _, t_ns, own_ns = _MESSAGE.unpack_from(content, record.start)
            data = content[record.start + _MESSAGE.size : record.end]
            yield Message(channel, t_ns, own_ns, data, record.offset)


def message_index(entries: Mapping[int, Sequence[tuple[int, int]]], offset: int) -> tuple[bytes, dict[int, int]]:
    """(time in ns, offset in the chunk) of the messages by channel -> records, and where each begins in the file.

    ``offset``: where the first of them will stand.
    """
    block, offsets = bytearray(), dict[int, int]()
    for channel, places in entries.items():
        offsets[channel] = offset + len(block)
        size = _INDEX_ENTRY.size * len(places)
        block += _INDEX_RECORD.pack(_INDEX_OPCODE, 6 + size, channel, size)
        block += b"".join(_INDEX_ENTRY.pack(*place) for place in places)
    return bytes(block), offsets
