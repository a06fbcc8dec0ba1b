"""Writes one flight as an MCAP file in small chunks that are on their way to the disk a quarter of a second later.

The library's own writer keeps far more in memory than may be lost when its process is killed, and does not see a
disk take only a part of what it is given; the records themselves are the library's.
"""

from __future__ import annotations

import os
import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Attachment, Channel, Chunk, Header, Metadata, Schema

from telemetry.recording.file_types import MCAP_MAGIC
from telemetry.recording.mcap_files.chunks import message_index
from telemetry.recording.mcap_files.closing import ChunkPlace, Closing
from telemetry.recording.mcap_files.continuing import ABOUT, LIBRARY, Begun
from telemetry.recording.mcap_files.foxglove import Standards, standard_schema
from telemetry.recording.mcap_files.scan import CONTINUED, attachment_index
from telemetry.recording.mcap_files.schemas import codec_of
from telemetry.recording.mcap_files.sink import Sink, Write
from telemetry.recording.recorded_topics import RAW_ENCODING, raw_channel_topic
from telemetry.topics.messages import MESSAGE_TYPES, PlanRecord, Published, RawFrame
from telemetry.topics.vehicle import VehicleState

PLAN, VEHICLE = "plan", "vehicle"
"""With ABOUT, the names of the metadata that tell what a recording is without reading it."""
_CHUNK_BYTES = 64 * 1024
_CHUNK_S = 0.2
_LARGE_CHUNK_BYTES = 4 * _CHUNK_BYTES
_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_OPCODE = 5
_LATEST_UTC_S = 4e9


class RecordingWriter:
    """One file. ``write`` collects, ``commit`` puts on disk; what was committed survives SIGKILL and a full disk."""

    def __init__(
        self,
        path: Path,
        *,
        t_utc_s: float,
        t_mono_s: float,
        name: str = "",
        by_hand: bool = False,
        begun: Begun | None = None,
        now: Callable[[], float] = time.monotonic,
        write: Write = os.write,
    ) -> None:
        """Creates the file, or goes on with what a killed recorder has ``begun``.

        ``t_utc_s`` and ``t_mono_s``: the same moment on both clocks. ``by_hand``: until the operator stops it.

        Raises RecordingFullError and RecordingError, as do ``write``, ``commit`` and ``close``.
        """
        self.path = path
        self.messages = 0
        """Committed ones, of what was published."""
        self._now, self._committed_mono_s = now, now()
        self._closing, self._standards = begun.closing if begun else Closing(), Standards()
        self._channels = {(each.topic, each.metadata.get("link", "")): n for n, each in self._closing.channels.items()}
        self._schemas = {each.name: n for n, each in self._closing.schemas.items()}
        self._notes: dict[str, dict[str, str]] = {}
        self._compressor = zstandard.ZstdCompressor(level=3)
        self._quick_compressor = zstandard.ZstdCompressor(level=1)
        self._last_ns = begun.end_ns if begun else 0
        self._clear()
        self._sink = Sink(path, keep=begun.keep if begun else None, write=write)
        try:
            self._sink.append(begun.index if begun else _head())
        except BaseException:
            self._sink.close()
            raise
        if begun:
            self._note(CONTINUED, {"from_utc_s": repr(begun.end_ns / 1e9), "until_utc_s": repr(t_utc_s)})
        else:
            about = {"t_utc_s": repr(t_utc_s), "t_mono_s": repr(t_mono_s), "name": name}
            self._note(ABOUT, {**about, "by_hand": str(by_hand)})

    @property
    def bytes(self) -> int:
        return self._sink.size

    def write(self, topic: str, message: Published, t_utc_s: float) -> None:
        """``t_utc_s``: when it came here; never goes back within a recording."""
        self._last_ns = t_ns = max(self._last_ns, round(t_utc_s * 1e9))
        if isinstance(message, RawFrame):
            channel = self._channel(raw_channel_topic(message.sent, message.spare), message.link, "", b"", RAW_ENCODING)
            self._add(channel, t_ns, _own_time_ns(message, t_ns), message.frame)
        else:
            codec: Any = codec_of(MESSAGE_TYPES[topic])
            channel = self._channel(topic, "", codec.schema_name, codec.schema, "json")
            self._add(channel, t_ns, _own_time_ns(message, t_ns), codec.encode(message))
            self._describe(message)
            for standard in self._standards.of(message):
                schema = standard_schema(standard.schema_name) if standard.schema_name not in self._schemas else b""
                channel = self._channel(standard.topic, "", standard.schema_name, schema, "json")
                self._add(channel, t_ns, _own_time_ns(message, t_ns), standard.data)
        self._new_messages += 1
        if len(self._chunk) >= _CHUNK_BYTES or self._now() - self._committed_mono_s >= _CHUNK_S:
            self.commit()

    def commit(self) -> None:
        """On disk with all that was written; does nothing when nothing was."""
        self._committed_mono_s = self._now()
        if not self._index and not self._new_notes:
            return
        place, block, notes = self._block()
        self._sink.append(block)
        for name, offset, length in notes:
            self._closing.add_metadata(name, offset, length)
        if place is not None:
            self._closing.add_chunk(place, {channel: len(entries) for channel, entries in self._index.items()})
        self.messages += self._new_messages
        self._clear()

    def attach(self, name: str, media_type: str, data: bytes, t_utc_s: float) -> None:
        """A file in the file, on disk at once."""
        self.commit()
        t_ns = round(t_utc_s * 1e9)
        attachment = Attachment(create_time=t_ns, log_time=t_ns, name=name, media_type=media_type, data=data)
        record, offset = _written(attachment), self._sink.size
        self._sink.append(record)
        self._closing.add_attachment(attachment_index(attachment, offset, len(record)))

    def close(self) -> None:
        """Finishes the file with its index, safely on disk. Without space for that it stays readable all the same."""
        try:
            self.commit()
            self._sink.append(self._closing.block(self._sink.size))
            self._sink.sync()
        finally:
            self._sink.close()

    def abandon(self) -> None:
        """Leaves the file as it is on disk."""
        self._sink.close()

    def _clear(self) -> None:
        self._chunk = bytearray()
        self._index: dict[int, list[tuple[int, int]]] = {}
        self._start_ns = self._last_ns
        self._new_messages = 0
        self._new_notes: list[tuple[str, bytes]] = []

    def _add(self, channel: int, t_ns: int, own_ns: int, data: bytes) -> None:
        if not self._index:
            self._start_ns = t_ns
        self._index.setdefault(channel, []).append((t_ns, len(self._chunk)))
        self._chunk += _MESSAGE.pack(_MESSAGE_OPCODE, 22 + len(data), channel, 0, t_ns, own_ns)
        self._chunk += data

    def _channel(self, topic: str, link: str, schema_name: str, schema: bytes, encoding: str) -> int:
        """Its number; where a channel is met first, its definition goes into the chunk."""
        known = self._channels.get((topic, link))
        if known is not None:
            return known
        number = self._channels[topic, link] = max(self._closing.channels, default=0) + 1
        channel = Channel(
            id=number,
            topic=topic,
            message_encoding=encoding,
            metadata={"link": link} if link else {},
            schema_id=self._schema(schema_name, schema),
        )
        self._closing.channels[number] = channel
        self._chunk += _written(channel)
        return number

    def _schema(self, name: str, data: bytes) -> int:
        if not name:
            return 0
        if name not in self._schemas:
            number = self._schemas[name] = max(self._closing.schemas, default=0) + 1
            schema = self._closing.schemas[number] = Schema(id=number, data=data, encoding="jsonschema", name=name)
            self._chunk += _written(schema)
        return self._schemas[name]

    def _describe(self, message: Published) -> None:
        if isinstance(message, PlanRecord):
            names = ("name", "digest", "terrain_id", "terrain_name", "terrain_sha256")
            self._note(PLAN, {name: str(getattr(message, name)) for name in names})
        elif isinstance(message, VehicleState) and message.heartbeat_t_mono_s is not None:
            names = ("autopilot", "vehicle_type", "firmware_version", "system_id", "component_id")
            self._note(VEHICLE, {name: str(getattr(message, name) or "") for name in names})

    def _note(self, name: str, values: dict[str, str]) -> None:
        if self._notes.get(name) != values:
            self._notes[name] = values
            self._new_notes.append((name, _written(Metadata(name=name, metadata=values))))

    def _block(self) -> tuple[ChunkPlace | None, bytes, list[tuple[str, int, int]]]:
        block, notes = bytearray(), []
        for name, record in self._new_notes:
            notes.append((name, self._sink.size + len(block), len(record)))
            block += record
        if not self._index:
            return None, bytes(block), notes
        offset, data = self._sink.size + len(block), bytes(self._chunk)
        # Noise of point clouds packs hardly better for the longer time that others would wait.
        compressor = self._quick_compressor if len(data) > _LARGE_CHUNK_BYTES else self._compressor
        packed = compressor.compress(data)
        chunk = _written(
            Chunk(
                compression="zstd",
                data=packed,
                message_end_time=self._last_ns,
                message_start_time=self._start_ns,
                uncompressed_crc=zlib.crc32(data),
                uncompressed_size=len(data),
            )
        )
        indexes, channels = message_index(self._index, offset + len(chunk))
        place = ChunkPlace(
            offset, len(chunk), self._start_ns, self._last_ns, channels, len(indexes), "zstd", len(packed), len(data)
        )
        return place, bytes(block + chunk + indexes), notes


def _head() -> bytes:
    return MCAP_MAGIC + _written(Header(profile="", library=LIBRARY))


def _written(record: Header | Channel | Schema | Metadata | Attachment | Chunk) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _own_time_ns(message: Published, t_ns: int) -> int:
    """When the message itself says that it is from; when it came for those that do not say."""
    own_utc_s = getattr(message, "t_utc_s", 0.0)
    # A sensor elsewhere may say anything, and the file has room for this century.
    return round(own_utc_s * 1e9) if 0 < own_utc_s < _LATEST_UTC_S else t_ns
