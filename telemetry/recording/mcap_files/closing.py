"""The index at the end of an MCAP file, collected while its chunks are written or found."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from telemetry.recording.file_types import MCAP_MAGIC

_FOOTER_BYTES = 8 + 8 + 4


@dataclass(frozen=True, slots=True)
class ChunkPlace:
    """A chunk in a file. ``channels``: where the message index of each channel stands; empty if there is none."""

    offset: int
    length: int
    start_ns: int
    end_ns: int
    channels: dict[int, int]
    index_length: int
    compression: str
    compressed_size: int
    uncompressed_size: int

    @property
    def end_offset(self) -> int:
        return self.offset + self.length + self.index_length


class Closing:
    """Grows with every chunk by a few hundred bytes: chunk indexes are kept as they will be written."""

    def __init__(self) -> None:
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: dict[int, int] = {}
        self._chunks, self._chunk_count = RecordBuilder(), 0
        self._metadata, self._metadata_count = RecordBuilder(), 0
        self._attachments, self._attachment_count = RecordBuilder(), 0
        self._start_ns, self._end_ns = 0, 0

    def add_chunk(self, place: ChunkPlace, counts: dict[int, int]) -> None:
        """``counts``: messages in it by channel."""
        ChunkIndex(
            chunk_length=place.length,
            chunk_start_offset=place.offset,
            compression=place.compression,
            compressed_size=place.compressed_size,
            message_end_time=place.end_ns,
            message_index_length=place.index_length,
            message_index_offsets=place.channels,
            message_start_time=place.start_ns,
            uncompressed_size=place.uncompressed_size,
        ).write(self._chunks)
        for channel, count in counts.items():
            self.counts[channel] = self.counts.get(channel, 0) + count
        self._start_ns = min(self._start_ns, place.start_ns) if self._chunk_count else place.start_ns
        self._end_ns = max(self._end_ns, place.end_ns)
        self._chunk_count += 1

    def add_metadata(self, name: str, offset: int, length: int) -> None:
        MetadataIndex(offset=offset, length=length, name=name).write(self._metadata)
        self._metadata_count += 1

    def add_attachment(self, index: AttachmentIndex) -> None:
        index.write(self._attachments)
        self._attachment_count += 1

    def block(self, offset: int) -> bytes:
        """All that stands behind the last chunk of a finished file, to be written at ``offset``."""
        head = RecordBuilder()
        DataEnd(0).write(head)
        start = offset + head.count
        groups = ((Opcode.SCHEMA, self._written(self.schemas)), (Opcode.CHANNEL, self._written(self.channels)))
        groups += ((Opcode.STATISTICS, self._statistics()), (Opcode.CHUNK_INDEX, _copy(self._chunks)))
        groups += ((Opcode.ATTACHMENT_INDEX, _copy(self._attachments)),)
        groups += ((Opcode.METADATA_INDEX, _copy(self._metadata)),)
        summary, offsets = bytearray(), RecordBuilder()
        for opcode, records in groups:
            if records:
                SummaryOffset(group_opcode=opcode, group_start=start + len(summary), group_length=len(records)).write(
                    offsets
                )
                summary += records
        offsets_start = start + len(summary)
        summary += offsets.end()
        return head.end() + bytes(summary) + _footer(bytes(summary), start, offsets_start) + MCAP_MAGIC

    def _statistics(self) -> bytes:
        builder = RecordBuilder()
        Statistics(
            attachment_count=self._attachment_count,
            channel_count=len(self.channels),
            channel_message_counts=self.counts,
            chunk_count=self._chunk_count,
            message_count=sum(self.counts.values()),
            message_end_time=self._end_ns,
            message_start_time=self._start_ns,
            metadata_count=self._metadata_count,
            schema_count=len(self.schemas),
        ).write(builder)
        return builder.end()

    @staticmethod
    def _written(records: dict[int, Schema] | dict[int, Channel]) -> bytes:
        builder = RecordBuilder()
        for record in records.values():
            record.write(builder)
        return builder.end()


def _copy(builder: RecordBuilder) -> bytes:
    """Without ending it: a file that could not be closed for want of space is closed later."""
    records = builder.end()
    builder.write(records)
    return records


def _footer(summary: bytes, summary_start: int, offsets_start: int) -> bytes:
    head = struct.pack("<BQQQ", Opcode.FOOTER, _FOOTER_BYTES, summary_start, offsets_start)
    builder = RecordBuilder()
    crc = zlib.crc32(head, zlib.crc32(summary))
    Footer(summary_start=summary_start, summary_offset_start=offsets_start, summary_crc=crc).write(builder)
    return builder.end()
