"""The messages of MAVLink's events interface and of its component metadata, which pymavlink's dialect does not have:
importing adds them.

Numbers, order of fields and seeds of the checksum are those of MAVLink's common set.
"""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

RESET = 1
"""Of CURRENT_EVENT_SEQUENCE's flags: the count has begun anew."""
ARGUMENT_BYTES = 40
_SIZES = {"uint8_t": 1, "uint16_t": 2, "uint32_t": 4}
_LETTERS = {"uint8_t": "B", "uint16_t": "H", "uint32_t": "I"}


class _AddedMessage(mavlink.MAVLink_message):
    """Made of the values of its fields, in the order in which the common set names them."""

    def __init__(self, *values: Any) -> None:
        super().__init__(self.id, self.msgname)
        self._fieldnames = self.fieldnames
        for name, value in zip(self.fieldnames, values, strict=True):
            setattr(self, name, value)

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        values: list[int] = []
        for name in self.ordered_fieldnames:
            value = getattr(self, name)
            values += [value] if isinstance(value, int) else list(value)
        return self._pack(mav, self.crc_extra, self.unpacker.pack(*values), force_mavlink1=force_mavlink1)


def _added(number: int, name: str, crc_extra: int, fields: dict[str, tuple[str, int]]) -> type[_AddedMessage]:
    """``fields``: type and length (0: no array) by name. On the wire larger types come first."""
    names = list(fields)
    ordered = sorted(names, key=lambda each: -_SIZES[fields[each][0]])
    lengths = [fields[each][1] for each in ordered]
    letters = "".join(f"{fields[each][1] or 1}{_LETTERS[fields[each][0]]}" for each in ordered)
    kind = type(
        f"MAVLink_{name.lower()}_message",
        (_AddedMessage,),
        {
            "id": number,
            "msgname": name,
            "name": name,
            "fieldnames": names,
            "ordered_fieldnames": ordered,
            "fieldtypes": [fields[each][0] for each in names],
            "native_format": bytearray(f"<{letters}".encode()),
            "orders": [ordered.index(each) for each in names],
            "lengths": [length or 1 for length in lengths],
            "array_lengths": lengths,
            "crc_extra": crc_extra,
            "unpacker": struct.Struct(f"<{letters}"),
        },
    )
    mavlink.mavlink_map[number] = kind
    return kind


BYTE, SHORT, LONG = ("uint8_t", 0), ("uint16_t", 0), ("uint32_t", 0)
EventMessage = _added(
    410,
    "EVENT",
    160,
    {
        "destination_component": BYTE,
        "destination_system": BYTE,
        "id": LONG,
        "event_time_boot_ms": LONG,
        "sequence": SHORT,
        "log_levels": BYTE,
        "arguments": ("uint8_t", ARGUMENT_BYTES),
    },
)
CurrentEventSequence = _added(411, "CURRENT_EVENT_SEQUENCE", 106, {"sequence": SHORT, "flags": BYTE})
RequestEvent = _added(
    412,
    "REQUEST_EVENT",
    33,
    {"target_system": BYTE, "target_component": BYTE, "first_sequence": SHORT, "last_sequence": SHORT},
)
ResponseEventError = _added(
    413,
    "RESPONSE_EVENT_ERROR",
    77,
    {
        "target_system": BYTE,
        "target_component": BYTE,
        "sequence": SHORT,
        "sequence_oldest_available": SHORT,
        "reason": BYTE,
    },
)
ComponentMetadata = _added(
    397,
    "COMPONENT_METADATA",
    182,
    {"time_boot_ms": LONG, "file_crc": LONG, "uri": ("uint8_t", 100)},
)
KNOWN_MESSAGES = mavlink.mavlink_map
"""All that can be decoded, these among them."""
