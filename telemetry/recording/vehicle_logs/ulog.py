"""ULog files of PX4: how topics are packed, which of them are logged, and their records behind a length each.

After https://docs.px4.io/main/en/dev_log/ulog_file_format. Records have no checksum; the log writes a mark now and
then, and reading goes on behind the next one when a record makes no sense. Sizes are believed only as far as a record
can be long, so that no file can hold the reader up.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from telemetry.recording.tlog import Damage, Data
from telemetry.recording.vehicle_logs.rows import NO_ROWS, Rows, gathered

MAGIC = b"ULog\x01\x12\x35"
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
FILE_HEAD_BYTES, _RECORD_HEAD_BYTES, _TOPIC_BYTES = 16, 3, 2
_KNOWN = frozenset(b"FADLCIMPQSORB")
_LARGEST = 65535
_MOST_FIELDS, _DEEPEST = 1024, 16
"""Of a topic's description; what is described within it, in how many steps."""
_TYPES = {
    "int8_t": "i1",
    "uint8_t": "u1",
    "bool": "u1",
    "char": "S1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
}


@dataclass(slots=True)
class ULog:
    """Where the wanted records stand, and what the log tells in words and single figures."""

    data: Data
    formats: dict[str, str] = field(default_factory=dict)
    """``uint64_t timestamp;float[4] q;...`` by the name of a topic."""
    topics: dict[int, tuple[str, int]] = field(default_factory=dict)
    """(name, instance) by the number that stands before a record."""
    found: dict[tuple[str, int], array[int]] = field(default_factory=dict)
    lengths: dict[tuple[str, int], int] = field(default_factory=dict)
    """The shortest record of each, without its head."""
    texts: list[tuple[int, int, str]] = field(default_factory=list)
    """(microseconds, MAV_SEVERITY, text)"""
    told: dict[str, int | float | str] = field(default_factory=dict)
    """Information and parameters by their name; the first value of each."""
    dropouts_s: float = 0.0
    """How long the vehicle could not write."""
    newer: bool = False
    """Written in a way that this reader does not know."""
    appended: tuple[int, ...] = ()
    """Where the vehicle went on after it had crashed."""
    damage: Damage = field(default_factory=Damage)

    def rows(self, name: str, instance: int = 0) -> Rows:
        offsets = self.found.get((name, instance))
        layout = _layout(self.formats, name)
        if not offsets or layout is None:
            return NO_ROWS
        whole = self.lengths[name, instance]
        while layout.itemsize > whole and (names := layout.names):
            layout = np.dtype([(n, layout[n]) for n in names[:-1]])  # what pads a record at its end is not written
        return Rows(gathered(self.data, offsets, layout)) if layout.itemsize else NO_ROWS


def looks_like_ulog(data: Data) -> bool:
    return data[: len(MAGIC)] == MAGIC


def read_ulog(data: Data, wanted: Collection[str], *, start: int = FILE_HEAD_BYTES, head: ULog | None = None) -> ULog:
    """All records of the ``wanted`` topics, and everything that is told in words.

    From byte ``start`` on, where a record begins, with what the ``head`` of the file told.
    """
    log = ULog(data) if head is None else ULog(data, dict(head.formats), dict(head.topics))
    at, size = start, len(data)
    while at < size and not log.newer:
        end = _end_of_record(data, at)
        jump = next((offset for offset in log.appended if at < offset < (end or size + 1)), None)
        if jump is not None:
            at = jump
        elif end is None:
            at = _behind_next_mark(log, at)
        else:
            _take(log, data[at + 2], at + _RECORD_HEAD_BYTES, end, wanted)
            at = end
    return log


def _end_of_record(data: Data, at: int) -> int | None:
    """None where no whole record stands."""
    head = data[at : at + _RECORD_HEAD_BYTES]
    if len(head) < _RECORD_HEAD_BYTES or head[2] not in _KNOWN:
        return None
    end = at + _RECORD_HEAD_BYTES + (head[0] | head[1] << 8)
    return end if end <= len(data) else None


def _behind_next_mark(log: ULog, at: int) -> int:
    mark, size = log.data.find(SYNC, at), len(log.data)
    after = size if mark < 0 else mark + len(SYNC)
    log.damage.cut_short |= mark < 0
    log.damage.spans += mark >= 0
    log.damage.bytes += after - at
    return after


def _take(log: ULog, kind: int, at: int, end: int, wanted: Collection[str]) -> None:
    if kind == ord("D"):
        _record(log, at, end)
        return
    content = bytes(log.data[at:end])
    if kind == ord("A") and len(content) > 3:
        name = content[3:].decode("latin-1")
        if name in wanted:
            log.topics[content[1] | content[2] << 8] = (name, content[0])
    elif kind == ord("F"):
        name, _, fields = content.decode("latin-1").partition(":")
        log.formats.setdefault(name, fields)
    elif kind in b"LC":
        _text(log, content, 3 if kind == ord("C") else 1)
    elif kind in b"IP":
        _tell(log, content)
    elif kind == ord("O") and len(content) >= 2:
        log.dropouts_s += (content[0] | content[1] << 8) / 1000
    elif kind == ord("B"):
        _flags(log, content)


def _record(log: ULog, at: int, end: int) -> None:
    head = log.data[at : at + _TOPIC_BYTES + 8]
    topic = log.topics.get(head[0] | head[1] << 8) if len(head) == _TOPIC_BYTES + 8 else None
    if topic is None:
        return
    log.found.setdefault(topic, array("Q")).append(at + _TOPIC_BYTES)
    length = end - at - _TOPIC_BYTES
    log.lengths[topic] = min(length, log.lengths.get(topic, length))


def _text(log: ULog, content: bytes, before_time: int) -> None:
    if len(content) >= before_time + 8:
        t_us = int.from_bytes(content[before_time : before_time + 8], "little")
        severity = min(7, max(0, content[0] - ord("0")))
        log.texts.append((t_us, severity, content[before_time + 8 :].decode(errors="replace").strip()))


def _tell(log: ULog, content: bytes) -> None:
    length = content[0] if content else 0
    key, value = content[1 : 1 + length].decode("latin-1"), content[1 + length :]
    written_as, _, name = key.partition(" ")
    if written_as.startswith("char["):
        log.told.setdefault(name, value.decode(errors="replace"))
    elif written_as in _TYPES and len(value) == np.dtype(_TYPES[written_as]).itemsize and written_as != "char":
        log.told.setdefault(name, np.frombuffer(value, _TYPES[written_as])[0].item())


def _flags(log: ULog, content: bytes) -> None:
    if len(content) < 40:
        return
    log.newer = bool(content[8] & ~1 or any(content[9:16]))
    log.appended = tuple(sorted(offset for offset in struct.unpack("<3Q", content[16:40]) if offset))


def _layout(formats: dict[str, str], name: str, within: tuple[str, ...] = ()) -> np.dtype[Any] | None:
    """None for one that is not described, or not so that it could be a record."""
    if name not in formats or name in within or len(within) > _DEEPEST:
        return None
    fields: list[tuple[str, Any, tuple[int, ...]]] = []
    size = 0
    for text in formats[name].split(";")[:_MOST_FIELDS]:
        if not text:
            continue
        written_as, _, label = text.partition(" ")
        kind, _, count = written_as.removesuffix("]").partition("[")
        layout = np.dtype(_TYPES[kind]) if kind in _TYPES else _layout(formats, kind, (*within, name))
        repeated = int(count) if count.isascii() and count.isdigit() and len(count) < 6 else 1 if not count else 0
        if layout is None or not label or repeated < 1:
            return None
        size += layout.itemsize * repeated
        if size > _LARGEST or any(label == other for other, _, _ in fields):
            return None
        fields.append((label, layout, (repeated,) if count else ()))
    return np.dtype(fields) if fields else None
