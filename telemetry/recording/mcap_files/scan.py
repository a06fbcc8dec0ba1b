"""What is where in an MCAP file: told by its index, or found by walking through up to the last whole record."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field, replace

from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, Channel, ChunkIndex, Footer, Header, Metadata, Schema, Statistics

from telemetry.recording.file_types import MCAP_MAGIC
from telemetry.recording.mcap_files.chunks import (
    BROKEN,
    RECORD_HEAD_BYTES,
    Record,
    chunk_content,
    chunk_place,
    record_at,
    records,
    stream_of,
)
from telemetry.recording.mcap_files.closing import ChunkPlace
from telemetry.recording.tlog import Data

CONTINUED = "continued"
"""Name of the metadata that tell between which times nothing was recorded."""
_CHANNEL = struct.Struct("<H")
"""The first field of messages and of their indexes."""
_FOOTER_BYTES = RECORD_HEAD_BYTES + 20 + len(MCAP_MAGIC)


@dataclass(slots=True)
class Contents:
    """Where everything is in a file."""

    library: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkPlace] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    """The last of each name."""
    continued: list[dict[str, str]] = field(default_factory=list)
    """Each time that a recorder went on with the file of one that had been killed."""
    metadata_places: list[tuple[str, int, int]] = field(default_factory=list)
    attachments: dict[str, AttachmentIndex] = field(default_factory=dict)
    """The last of each name."""
    start_ns: int = 0
    end_ns: int = 0
    """Both 0: without any message."""
    finished: bool = False
    """With an index at the end, as a recorder that was not killed leaves it."""


def read_contents(data: Data) -> Contents:
    """By the index at the end if there is a sound one, otherwise by walking through."""
    try:
        return _by_index(data)
    except BROKEN:
        return _by_walking(data)


def glance(data: Data) -> Contents:
    """Without chunks and channels if there is a sound index: what a list needs, in a fraction of the time."""
    try:
        contents = Contents(library=_header(data).library, finished=True)
        start, stop = _index_place(data)
        for record in records(data, start, stop):
            if record.opcode == Opcode.METADATA_INDEX:
                _take_indexed(data, record, start, contents)
            elif record.opcode == Opcode.STATISTICS:
                statistics = Statistics.read(stream_of(data, record))
                contents.start_ns, contents.end_ns = statistics.message_start_time, statistics.message_end_time
        return contents
    except BROKEN:
        return _by_walking(data)


def _index_place(data: Data) -> tuple[int, int]:
    """Where the records at the end begin and stop. ValueError when there are none."""
    size = len(data)
    if size < _FOOTER_BYTES + len(MCAP_MAGIC) or data[size - len(MCAP_MAGIC) :] != MCAP_MAGIC:
        raise ValueError("no index")
    footer = record_at(data, size - _FOOTER_BYTES, size)
    start = Footer.read(stream_of(data, footer)).summary_start
    if footer.opcode != Opcode.FOOTER or not len(MCAP_MAGIC) <= start < footer.offset:
        raise ValueError("no index")
    return start, footer.offset


def _by_index(data: Data) -> Contents:
    start, stop = _index_place(data)
    contents = Contents(library=_header(data).library, finished=True)
    for record in records(data, start, stop):
        if record.opcode == Opcode.CHUNK_INDEX:
            contents.chunks.append(_indexed_chunk(ChunkIndex.read(stream_of(data, record)), start))
        elif record.opcode == Opcode.METADATA_INDEX:
            _take_indexed(data, record, start, contents)
        else:
            _take(data, record, contents)
    _note_times(contents)
    return contents


def _take_indexed(data: Data, record: Record, stop: int, contents: Contents) -> None:
    """The metadata that an entry of the index points to."""
    (offset,) = struct.unpack_from("<Q", data, record.start)
    _take(data, record_at(data, offset, stop), contents)


def _note_times(contents: Contents) -> None:
    if contents.chunks:
        contents.start_ns = contents.chunks[0].start_ns
        contents.end_ns = max(chunk.end_ns for chunk in contents.chunks)


def _indexed_chunk(index: ChunkIndex, stop: int) -> ChunkPlace:
    place = ChunkPlace(
        offset=index.chunk_start_offset,
        length=index.chunk_length,
        start_ns=index.message_start_time,
        end_ns=index.message_end_time,
        channels=index.message_index_offsets,
        index_length=index.message_index_length,
        compression=index.compression,
        compressed_size=index.compressed_size,
        uncompressed_size=index.uncompressed_size,
    )
    if place.end_offset > stop:
        raise ValueError("an index that points behind the data")
    return place


def _by_walking(data: Data) -> Contents:
    contents, chunk = Contents(library=_header(data).library), None
    for record in records(data, len(MCAP_MAGIC), len(data)):
        try:
            if record.opcode == Opcode.DATA_END:
                break
            if record.opcode == Opcode.CHUNK:
                chunk = chunk_place(data, record)
                contents.chunks.append(chunk)
            elif record.opcode == Opcode.MESSAGE_INDEX and chunk is not None:
                (channel,) = _CHANNEL.unpack_from(data, record.start)
                chunk.channels[channel] = record.offset
                chunk = replace(chunk, index_length=record.end - chunk.offset - chunk.length)
                contents.chunks[-1] = chunk
            else:
                _take(data, record, contents)
        except BROKEN:
            break
    _find_channels(data, contents)
    _note_times(contents)
    return contents


def _find_channels(data: Data, contents: Contents) -> None:
    """Definitions stand in the chunk whose messages need them first. The last chunk's indexes may be cut off."""
    for chunk in contents.chunks:
        if chunk is not contents.chunks[-1] and chunk.channels.keys() <= contents.channels.keys():
            continue
        try:
            content = chunk_content(data, chunk)
        except BROKEN:
            continue
        for record in records(content, 0, len(content)):
            if record.opcode != Opcode.MESSAGE:
                _take(content, record, contents)
            else:
                chunk.channels.setdefault(_CHANNEL.unpack_from(content, record.start)[0], 0)


def _header(data: Data) -> Header:
    record = record_at(data, len(MCAP_MAGIC), len(data))
    if record.opcode != Opcode.HEADER:
        raise ValueError("no header")
    return Header.read(stream_of(data, record))


def _take(data: Data, record: Record, contents: Contents) -> None:
    if record.opcode == Opcode.SCHEMA:
        schema = Schema.read(stream_of(data, record))
        contents.schemas[schema.id] = schema
    elif record.opcode == Opcode.CHANNEL:
        channel = Channel.read(stream_of(data, record))
        contents.channels[channel.id] = channel
    elif record.opcode == Opcode.METADATA:
        metadata = Metadata.read(stream_of(data, record))
        contents.metadata[metadata.name] = metadata.metadata
        if metadata.name == CONTINUED:
            contents.continued.append(metadata.metadata)
        contents.metadata_places.append((metadata.name, record.offset, record.end - record.offset))
    elif record.opcode == Opcode.ATTACHMENT_INDEX:
        index = AttachmentIndex.read(stream_of(data, record))
        contents.attachments[index.name] = index
    elif record.opcode == Opcode.ATTACHMENT:
        index = attachment_index(Attachment.read(stream_of(data, record)), record.offset, record.end - record.offset)
        contents.attachments[index.name] = index


def attachment_index(attachment: Attachment, offset: int, length: int) -> AttachmentIndex:
    """Of an attachment whose record stands there."""
    return AttachmentIndex(
        offset=offset,
        length=length,
        log_time=attachment.log_time,
        create_time=attachment.create_time,
        data_size=len(attachment.data),
        name=attachment.name,
        media_type=attachment.media_type,
    )
