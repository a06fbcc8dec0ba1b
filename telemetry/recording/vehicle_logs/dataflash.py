"""DataFlash logs of ArduPilot: two marker bytes, the number of a kind, and a record that the log itself describes.

Records have no checksum. A stretch that is not understood is skipped up to the next record that another one, or the
end of the file, follows: so a bad span costs nothing but itself, and no file can hold the reader up.
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

MARKER = b"\xa3\x95"
_HEAD_BYTES = 3
_FORMAT_KIND, _FORMAT = 0x80, struct.Struct("<BB4s16s64s")
_PAGE_BYTES = 256
"""Logs on flash memory are whole pages: behind the last record up to so many bytes are blank."""
_TYPES: dict[str, tuple[str, float]] = {
    "a": ("(32,)<i2", 1.0),
    "b": ("i1", 1.0),
    "B": ("u1", 1.0),
    "M": ("u1", 1.0),
    "h": ("<i2", 1.0),
    "H": ("<u2", 1.0),
    "i": ("<i4", 1.0),
    "I": ("<u4", 1.0),
    "q": ("<i8", 1.0),
    "Q": ("<u8", 1.0),
    "g": ("<f2", 1.0),
    "f": ("<f4", 1.0),
    "d": ("<f8", 1.0),
    "n": ("S4", 1.0),
    "N": ("S16", 1.0),
    "Z": ("S64", 1.0),
    "c": ("<i2", 1e-2),
    "C": ("<u2", 1e-2),
    "e": ("<i4", 1e-2),
    "E": ("<u4", 1e-2),
    "L": ("<i4", 1e-7),
}


@dataclass(frozen=True, slots=True)
class Kind:
    """How one kind of record is packed."""

    name: str
    length: int
    """With marker and number."""
    layout: np.dtype[Any] | None
    """Behind marker and number; None where the log's description of it makes no sense."""
    scales: dict[str, float]


@dataclass(slots=True)
class DataFlash:
    """Where the wanted records stand, and how all are packed."""

    data: Data
    kinds: dict[int, Kind] = field(default_factory=lambda: {_FORMAT_KIND: Kind("FMT", 89, None, {})})
    found: dict[int, array[int]] = field(default_factory=dict)
    """By the number of the kind: a name may stand for two that are packed in two ways."""
    damage: Damage = field(default_factory=Damage)

    def rows(self, name: str) -> Rows:
        for number, kind in self.kinds.items():
            offsets = self.found.get(number)
            if offsets and kind.name == name and kind.layout is not None:
                return Rows(gathered(self.data, (at + _HEAD_BYTES for at in offsets), kind.layout), kind.scales)
        return NO_ROWS


def read_dataflash(
    data: Data, wanted: Collection[str], *, start: int = 0, kinds: dict[int, Kind] | None = None
) -> DataFlash:
    """All records of the ``wanted`` kinds; from byte ``start`` on with ``kinds`` that were read before."""
    log = DataFlash(data) if kinds is None else DataFlash(data, dict(kinds))
    at, size, in_step = start, len(data), False
    while at < size:
        kind = _kind_at(log, at, in_step)
        if kind is None:
            after = _next_record(log, at + 1)
            _count(log, at, after)
            at, in_step = after, False
            continue
        if kind.name == "FMT":
            _describe(log, at)
        elif kind.name in wanted:
            log.found.setdefault(data[at + len(MARKER)], array("Q")).append(at)
        at, in_step = at + kind.length, True
    return log


def looks_like_dataflash(data: Data) -> bool:
    """Whether it begins as every such log does: with how its records are packed."""
    return data[:_HEAD_BYTES] == MARKER + bytes((_FORMAT_KIND,))


def _kind_at(log: DataFlash, at: int, in_step: bool) -> Kind | None:
    """Of a whole record at ``at``; behind a bad stretch one is believed only if another follows it."""
    head = log.data[at : at + _HEAD_BYTES]
    if len(head) < _HEAD_BYTES or not head.startswith(MARKER):
        return None
    kind = log.kinds.get(head[2])
    if kind is None or at + kind.length > len(log.data):
        return None
    after = at + kind.length
    follows = after == len(log.data) or log.data[after : after + 2] == MARKER
    return kind if in_step or at == 0 or follows else None


def _next_record(log: DataFlash, start: int) -> int:
    at = log.data.find(MARKER, start)
    while at >= 0 and _kind_at(log, at, in_step=False) is None:
        at = log.data.find(MARKER, at + 1)
    return len(log.data) if at < 0 else at


def _count(log: DataFlash, at: int, after: int) -> None:
    size, damage = len(log.data), log.damage
    if after == size and size - at <= _PAGE_BYTES and not log.data[at:size].strip(b"\xff\0"):
        return
    damage.cut_short |= after == size
    damage.spans += after < size
    damage.bytes += after - at


def _describe(log: DataFlash, at: int) -> None:
    """The first description of a kind counts: no log packs it in two ways."""
    number, length, name, letters, columns = _FORMAT.unpack(log.data[at + _HEAD_BYTES : at + 89])
    if number in log.kinds or length < _HEAD_BYTES:
        return
    log.kinds[number] = Kind(_text(name), length, *_layout(_text(letters), _text(columns).split(","), length))


def _layout(letters: str, names: list[str], length: int) -> tuple[np.dtype[Any] | None, dict[str, float]]:
    is_sound = len(letters) == len(names) == len(set(names)) and all(names) and set(letters) <= set(_TYPES)
    if not is_sound:
        return None, {}
    layout = np.dtype([(name, _TYPES[letter][0]) for name, letter in zip(names, letters, strict=True)])
    scales = {name: _TYPES[letter][1] for name, letter in zip(names, letters, strict=True)}
    return (layout, scales) if layout.itemsize == length - _HEAD_BYTES else (None, {})


def _text(padded: bytes) -> str:
    return padded.split(b"\0", 1)[0].decode("latin-1")
