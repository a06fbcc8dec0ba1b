"""Files that a vehicle makes while they are read: ArduPilot's packed list of parameters."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from telemetry.mavlink.logs.ftp.payload import MOST_DATA
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Kind, Parameters

PACKED = "/@PARAM/param.pck"
_LAYOUTS: dict[Kind, tuple[int, str]] = {"int8": (1, "<b"), "int16": (2, "<h"), "int32": (3, "<i"), "float": (4, "<f")}
_BYTES_EACH = 12
"""As ArduPilot estimates before it has made the file."""


@dataclass(frozen=True, slots=True)
class MadeFile:
    content: bytes
    said_bytes: int
    """At opening."""


def ardupilot_file(parameters: Parameters, path: str) -> MadeFile | None:
    """None: there is none of this path."""
    name, _, query = path.partition("?")
    if name != PACKED or query not in ("", "withdefaults=1"):
        return None
    return MadeFile(packed(parameters, with_defaults=bool(query)), _BYTES_EACH * len(parameters))


def packed(parameters: Parameters, *, with_defaults: bool, block: int = MOST_DATA) -> bytes:
    """No value lies across two blocks: one that is read again then never mixes an old value with a new one."""
    out = bytearray(struct.pack("<HHH", 0x671C if with_defaults else 0x671B, len(parameters), len(parameters)))
    before = ""
    for name, spec in parameters.specs.items():
        number, layout = _LAYOUTS[spec.kind]
        whole = (lambda value: value) if spec.kind == "float" else int
        values = [parameters[name]]
        if with_defaults and spec.default != parameters[name]:
            values.append(spec.default)
        shared = _shared(before, name)
        own, before = name[shared:].encode(), name
        data = b"".join(struct.pack(layout, whole(value)) for value in values)
        entry = bytes((number | (len(values) - 1) << 4, shared | (len(own) - 1) << 4)) + own + data
        over, size = (len(out) + len(entry)) % block, struct.calcsize(layout)
        if size > 1 and 0 < over < size:
            out += bytes(size - over)
        out += entry
    return bytes(out)


def _shared(before: str, name: str) -> int:
    """Letters at the beginning that are the same; at least one is the name's own."""
    same = next((at for at, (one, other) in enumerate(zip(before, name, strict=False)) if one != other), len(before))
    return min(same, len(name) - 1, 15)
