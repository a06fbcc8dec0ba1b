"""The parameter protocol as PX4 speaks it: integers bytewise, changes with their number, a hash before the list."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Hashable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.protocol.item_protocol import Reply
from telemetry.simulation.simulator.protocol.parameter_protocol import HASH, UNNUMBERED, ParameterList

UINT32, INT32, FLOAT = wire.MAV_PARAM_TYPE_UINT32, wire.MAV_PARAM_TYPE_INT32, wire.MAV_PARAM_TYPE_REAL32


class Px4ParametersOnWire:
    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._names = list(parameters)
        self.list = ParameterList(self._names, lambda name, _: self._value(name))

    def on_message(self, message: Any, peer: Hashable) -> list[Reply]:
        """Answers to the one that asked; nothing about parameters that it does not have."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            self.list.begin(peer)
            return [(peer, self._hash())]
        if kind != "PARAM_REQUEST_READ":
            return []
        index, name = message.param_index, message.param_id
        if index < 0 and name == HASH:
            return [(peer, self._hash())]
        if index < 0:
            return [(peer, self._value(name))] if name in self._parameters else []
        return [(peer, self._value(self._names[index]))] if index < len(self._names) else []

    def on_set(self, message: Any) -> list[Any]:
        """What everybody hears of it: the value that is kept."""
        name = message.param_id
        if name not in self._parameters or message.param_type != self._type(name):
            return [self._value(name)] if name in self._parameters else []
        value = message.param_value
        if message.param_type == INT32:
            value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        self._parameters.set(name, value)
        return [self._value(name)]

    def _type(self, name: str) -> int:
        return FLOAT if self._parameters.specs[name].kind == "float" else INT32

    def _value(self, name: str) -> Any:
        value, kind = self._parameters[name], self._type(name)
        if kind == INT32:
            value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        return wire.MAVLink_param_value_message(name.encode(), value, kind, len(self._names), self._names.index(name))

    def _hash(self) -> Any:
        content = b"".join(name.encode() + struct.pack("<d", self._parameters[name]) for name in self._names)
        value = struct.unpack("<f", struct.pack("<I", zlib.crc32(content)))[0]
        return wire.MAVLink_param_value_message(HASH.encode(), value, UINT32, len(self._names), UNNUMBERED)
