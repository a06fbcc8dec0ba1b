"""Values of parameters on the wire: integers as numbers (ArduPilot), or bytewise in the four bytes of a float (PX4)."""

from __future__ import annotations

import math
import struct

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Message
from telemetry.topics.parameters import SINGLE, WHOLE_RANGES, Parameter

BYTEWISE = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
_FORMATS = {1: "<B3x", 2: "<b3x", 3: "<H2x", 4: "<h2x", 5: "<I", 6: "<i"}
"""struct formats of MAV_PARAM_TYPE 1 to 6 within the four bytes of a float."""
_MAGIC_V1, _HEADER_V1, _HEADER_V2 = 0xFE, 6, 10


def parameter_of(message: Message, *, bytewise: bool) -> Parameter:
    """Of a PARAM_VALUE."""
    return Parameter(message.param_id, parameter_value(message, bytewise=bytewise), message.param_type)


def parameter_value(message: Message, *, bytewise: bool) -> float | None:
    """Of a PARAM_VALUE; None for what is no number."""
    layout = _FORMATS.get(message.param_type)
    if bytewise and layout is not None:
        return float(struct.unpack(layout, _four_bytes(message))[0])
    value = message.param_value
    return float(value) if math.isfinite(value) else None


def _four_bytes(message: Message) -> bytes:
    """As they came: some integers are signalling NaNs, whose bits a float does not keep."""
    frame = message.get_msgbuf()
    if not frame:
        return struct.pack("<f", message.param_value)
    begin = _HEADER_V1 if frame[0] == _MAGIC_V1 else _HEADER_V2
    return bytes(frame[begin : begin + 4])


def wire_value(value: float, kind: int, *, bytewise: bool) -> float | None:
    """The float of a PARAM_SET; None for an integer whose bytes no float carries unchanged."""
    layout = _FORMATS.get(kind)
    if not bytewise or layout is None:
        return value
    packed = struct.pack(layout, int(value))
    carried: float = struct.unpack("<f", packed)[0]
    return carried if struct.pack("<f", carried) == packed else None


def why_not(value: float, kind: int) -> str:
    """Why a parameter of this type cannot hold the value; empty when it can."""
    if not math.isfinite(value):
        return "It is no finite number."
    if kind not in WHOLE_RANGES:
        return "" if abs(value) <= 3.4028234e38 else "It is larger than single precision can hold."
    if value != round(value):
        return "This parameter holds whole numbers only."
    low, high = WHOLE_RANGES[kind]
    return "" if low <= value <= high else f"This parameter holds {low} to {high}."


def same_value(one: float, other: float, kind: int, *, bytewise: bool) -> bool:
    """As the vehicle can tell them apart: in single precision, but for integers that come bytewise."""
    if kind in WHOLE_RANGES and (bytewise or max(abs(one), abs(other)) < 2**24):
        return one == other
    return math.isclose(one, other, rel_tol=SINGLE)
