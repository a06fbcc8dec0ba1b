"""What the autopilot's makers say of its parameters, from a file that the user has: ArduPilot's apm.pdef.xml, or PX4's
parameters.json, also packed (.xz, .gz). None of it comes with Hedgehop."""

from __future__ import annotations

import lzma
import math
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, cast
from xml.etree.ElementTree import Element

from planning.errors import FormatError
from planning.formats.kml_reader import read_xml
from planning.formats.safe_text import MAX_BYTES, clean_name, decode_text, load_json

_XZ, _GZ = b"\xfd7zXZ\x00", b"\x1f\x8b"
_GZ_ONLY = 31
"""zlib: the largest window, and a header as gzip has it."""
_ADVICE = "Give ArduPilot's apm.pdef.xml, or PX4's parameters.json or parameters.json.xz."
MOST_WORDS = 4000
"""Characters of one text."""


@dataclass(frozen=True, slots=True)
class Description:
    """Of one parameter; what its makers do not say is empty or None."""

    title: str = ""
    text: str = ""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    default: float | None = None
    meanings: Mapping[float, str] = field(default_factory=dict[float, str])
    bits: Mapping[int, str] = field(default_factory=dict[int, str])
    reboot: bool = False
    """It counts from the vehicle's next start on."""

    def meaning(self, value: float) -> str:
        """Of this value: its name, or those of its bits."""
        if value in self.meanings:
            return self.meanings[value]
        if self.bits and value == round(value) and 0 < value < 2**31:
            names = (self.bits.get(bit, f"bit {bit}") for bit in range(31) if int(value) >> bit & 1)
            return " + ".join(names)
        return ""

    def has(self, text: str) -> bool:
        return text.casefold() in f"{self.title} {self.text}".casefold()

    def outside(self, value: float) -> bool:
        """Beyond what its makers recommend."""
        return (self.low is not None and value < self.low) or (self.high is not None and value > self.high)


def read_descriptions(name: str, data: bytes) -> dict[str, Description]:
    """By the parameters' names. Raises FormatError."""
    file = clean_name(name)
    data = unpacked(file, data)
    found = dict(_of_px4(file, data) if data.lstrip()[:1] == b"{" else _of_ardupilot(file, data))
    if not found:
        raise FormatError("The file describes no parameters.", where=file, advice=_ADVICE)
    return found


def unpacked(file: str, data: bytes) -> bytes:
    """Of .xz and .gz; others as they are. Raises FormatError for one that is damaged or unpacks to too much."""
    if not data.startswith((_XZ, _GZ)):
        return data
    try:
        unpacking = lzma.LZMADecompressor(memlimit=1 << 27) if data.startswith(_XZ) else zlib.decompressobj(_GZ_ONLY)
        text = unpacking.decompress(data, MAX_BYTES + 1)
    except (lzma.LZMAError, zlib.error):
        raise FormatError("The archive is corrupt.", where=file, advice=_ADVICE) from None
    if len(text) > MAX_BYTES:
        raise FormatError(f"The file unpacks to more than {MAX_BYTES} bytes.", where=file, advice=_ADVICE)
    if not unpacking.eof:
        raise FormatError("The archive is cut short.", where=file, advice=_ADVICE)
    return text


def _of_ardupilot(file: str, data: bytes) -> Iterator[tuple[str, Description]]:
    root = read_xml(file, data)
    if root.tag != "paramfile":
        raise FormatError("This XML describes no parameters.", where=file, advice=_ADVICE)
    for element in root.iter("param"):
        yield element.get("name", "").rpartition(":")[2], _from_xml(element)


def _from_xml(element: Element) -> Description:
    fields = {e.get("name", ""): (e.text or "").strip() for e in element.iter("field")}
    range_ = fields.get("Range", "").split()
    values = [(_number(e.get("code")), _words(e.text)) for e in element.iter("value")]
    return Description(
        title=_words(element.get("humanName")),
        text=_words(element.get("documentation")),
        unit=_words(fields.get("Units")),
        low=_number(range_[0]) if len(range_) == 2 else None,
        high=_number(range_[1]) if len(range_) == 2 else None,
        meanings={code: text for code, text in values if code is not None},
        bits=dict(_bits(fields.get("Bitmask", ""))),
        reboot=fields.get("RebootRequired", "").casefold() == "true",
    )


def _bits(text: str) -> Iterator[tuple[int, str]]:
    for part in text.split(","):
        number, _, name = part.partition(":")
        if number.strip().isdecimal() and len(number) < 4:
            yield int(number), _words(name)


def _of_px4(file: str, data: bytes) -> Iterator[tuple[str, Description]]:
    content = load_json(file, decode_text(file, data))
    entries = cast(dict[str, Any], content).get("parameters") if isinstance(content, dict) else None
    if not isinstance(entries, list):
        raise FormatError("This JSON describes no parameters.", where=file, advice=_ADVICE)
    for entry in cast(list[Any], entries):
        if isinstance(entry, dict) and isinstance(entry.get("name"), str):
            yield entry["name"], _from_json(cast(dict[str, Any], entry))


def _from_json(entry: dict[str, Any]) -> Description:
    return Description(
        title=_words(entry.get("shortDesc")),
        text=_words(entry.get("longDesc")),
        unit=_words(entry.get("units")),
        low=_number(entry.get("min")),
        high=_number(entry.get("max")),
        default=_number(entry.get("default")),
        meanings=dict(_pairs(entry.get("values"), "value")),
        bits={int(bit): text for bit, text in _pairs(entry.get("bitmask"), "index")},
        reboot=entry.get("rebootRequired") is True,
    )


def _pairs(entries: object, key: str) -> Iterator[tuple[float, str]]:
    for entry in cast(list[Any], entries) if isinstance(entries, list) else ():
        if isinstance(entry, dict) and (number := _number(cast(dict[str, Any], entry).get(key))) is not None:
            yield number, _words(cast(dict[str, Any], entry).get("description"))


def _number(value: object) -> float | None:
    try:
        number = float(cast(Any, value))
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def _words(text: object) -> str:
    return " ".join(text.split())[:MOST_WORDS] if isinstance(text, str) else ""
