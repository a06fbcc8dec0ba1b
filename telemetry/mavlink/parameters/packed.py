"""ArduPilot's file of all its parameters, @PARAM/param.pck, as its documentation of AP_Filesystem describes it.

Little-endian. A header of three 16-bit numbers: 0x671B, or 0x671C where defaults stand in it; how many follow; how many
there are. Then of each: type and flags (4 bits each), bytes that its name shares with the one before and how many are
its own less one (4 bits each), those bytes, the value, and the default where it is another one. Zeros between them fill
up blocks.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator

from telemetry.errors import TransferError
from telemetry.topics.parameters import NAME_PATTERN, Parameter

PATH = "@PARAM/param.pck?withdefaults=1"
"""Firmware without defaults in it sends the file without them."""
PLAIN, WITH_DEFAULTS = 0x671B, 0x671C
MOST_BYTES = 1 << 20
"""65,535 of the longest entries are larger; the largest firmware has some 30,000 bytes."""
_HEADER = struct.Struct("<HHH")
_VALUES = {
    1: (struct.Struct("<b"), 2),
    2: (struct.Struct("<h"), 4),
    3: (struct.Struct("<i"), 6),
    4: (struct.Struct("<f"), 9),
}
"""Layout and MAV_PARAM_TYPE by ArduPilot's own types."""
_HAS_DEFAULT = 1
_NAME = re.compile(NAME_PATTERN.encode())


def read_packed(data: bytes) -> tuple[Parameter, ...]:
    """Every parameter, in the vehicle's order. Raises TransferError for a file that is not whole or makes no sense."""
    if len(data) < _HEADER.size:
        raise _senseless("ends within its header")
    magic, count, total = _HEADER.unpack_from(data)
    if magic not in (PLAIN, WITH_DEFAULTS):
        raise _senseless(f"begins with {magic:#06x}")
    if not 0 < count == total:
        raise _senseless(f"says that it has {count} of {total} parameters")
    found = tuple(_entries(data, with_defaults=magic == WITH_DEFAULTS))
    if len(found) != count:
        raise _senseless(f"has {len(found)} parameters and says {count}")
    if len({parameter.name for parameter in found}) != count:
        raise _senseless("has a parameter twice")
    return found


def _entries(data: bytes, *, with_defaults: bool) -> Iterator[Parameter]:
    at, before = _HEADER.size, b""
    while at < len(data):
        if not data[at]:
            at += 1
            continue
        if at + 2 > len(data):
            raise _senseless(f"ends within an entry, at byte {at}")
        kind, flags, shared, own = data[at] & 15, data[at] >> 4, data[at + 1] & 15, (data[at + 1] >> 4) + 1
        if kind not in _VALUES:
            raise _senseless(f"has type {kind} at byte {at}")
        layout, mav_type = _VALUES[kind]
        has_default = with_defaults and bool(flags & _HAS_DEFAULT)
        value_at = at + 2 + own
        end = value_at + layout.size * (2 if has_default else 1)
        before = _name(before, shared, data[at + 2 : value_at], at)
        if end > len(data):
            raise _senseless(f"ends within {before.decode()}")
        value = _number(layout, data, value_at)
        default = _number(layout, data, value_at + layout.size) if has_default else value if with_defaults else None
        yield Parameter(before.decode(), value, mav_type, default)
        at = end


def _name(before: bytes, shared: int, own: bytes, at: int) -> bytes:
    name = before[:shared] + own
    if shared > len(before) or not _NAME.fullmatch(name):
        raise _senseless(f"has no name of a parameter at byte {at}")
    return name


def _number(layout: struct.Struct, data: bytes, at: int) -> float | None:
    value = float(layout.unpack_from(data, at)[0])
    return value if math.isfinite(value) else None


def _senseless(does: str) -> TransferError:
    return TransferError(f"The vehicle's file of parameters {does}.", advice="Read the parameters again.")
