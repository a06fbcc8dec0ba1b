"""The parameter protocol of the simulated vehicle, as ArduPilot speaks it: values as floats, the list in a stream."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS, Kind, Parameters
from telemetry.simulation.simulator.protocol.mission_protocol import Reply

TYPES: dict[Kind, int] = {
    "int8": wire.MAV_PARAM_TYPE_INT8,
    "int16": wire.MAV_PARAM_TYPE_INT16,
    "int32": wire.MAV_PARAM_TYPE_INT32,
    "float": wire.MAV_PARAM_TYPE_REAL32,
}
UNNUMBERED = 65535
"""Index of an answer to a change and to a name."""
LIST_EVERY_S, LIST_SHARE = 0.02, 40
"""The whole list comes at up to 2,000 values a second, as 1,349 in 0.7 s on the real ArduCopter."""

HASH = "_HASH_CHECK"
"""PX4 answers to it, although it is no parameter."""


class ParameterList:
    """The whole list, streamed to each peer that asked for it; ``value`` of a name and its index."""

    def __init__(self, names: list[str], value: Callable[[str, int], Any]) -> None:
        self._names, self._value = names, value
        self._listing: dict[Hashable, int] = {}
        """How far it has come, by the peer that asked for it."""
        self._listed_s = 0.0

    def begin(self, peer: Hashable) -> None:
        self._listing[peer] = 0

    def on_tick(self, wall_s: float) -> list[Reply]:
        """The next values of the lists that were asked for."""
        if not self._listing or wall_s - self._listed_s < LIST_EVERY_S:
            return []
        self._listed_s = wall_s
        out: list[Reply] = []
        for peer, begin in tuple(self._listing.items()):
            end = begin + LIST_SHARE
            out += [(peer, self._value(name, begin + at)) for at, name in enumerate(self._names[begin:end])]
            self._listing[peer] = end
            if end >= len(self._names):
                del self._listing[peer]
        return out

    def forget(self, peer: Hashable) -> None:
        self._listing.pop(peer, None)


class ParameterProtocol:
    """Says nothing about parameters that it does not have."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._names = list(parameters)
        self.list = ParameterList(self._names, self._value)

    def on_message(self, message: Any, peer: Hashable) -> list[Reply]:
        """Answers to the one that asked."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            self.list.begin(peer)
            return []
        if kind != "PARAM_REQUEST_READ":
            return []
        index = message.param_index
        if index < 0:
            return [(peer, self._value(message.param_id, UNNUMBERED))] if message.param_id in self._parameters else []
        return [(peer, self._value(self._names[index], index))] if index < len(self._names) else []

    def on_set(self, message: Any) -> list[Any]:
        """What everybody hears of it: the value that is kept. A value that is no number is not answered."""
        if message.param_id not in self._parameters or not math.isfinite(message.param_value):
            return []
        self._parameters.set(message.param_id, message.param_value)
        return [self._value(message.param_id, UNNUMBERED)]

    def _value(self, name: str, index: int) -> Any:
        return wire.MAVLink_param_value_message(
            name.encode(), self._parameters[name], TYPES[SPECS[name].kind], len(self._names), index
        )


def parameter_error(message: Any, parameters: Parameters) -> Any | None:
    """PARAM_ERROR, as newer firmware of both makes says it to the station that reads or sets what cannot be.

    None: nothing is wrong with it. Older firmware is silent.
    """
    kind = message.get_type()
    if kind == "PARAM_REQUEST_READ":
        has = message.param_index < len(parameters) if message.param_index >= 0 else _has(message.param_id, parameters)
        return None if has else _unknown(message, message.param_index)
    if kind == "PARAM_SET" and message.param_id not in parameters:
        return _unknown(message, -1)
    return None


def _has(name: str, parameters: Parameters) -> bool:
    return name in parameters or name == HASH


def _unknown(message: Any, index: int) -> Any:
    station = message.get_srcSystem(), message.get_srcComponent()
    code = wire.MAV_PARAM_ERROR_DOES_NOT_EXIST
    return wire.MAVLink_param_error_message(*station, message.param_id.encode(), index, code)
