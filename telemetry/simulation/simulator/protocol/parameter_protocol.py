"""The parameter protocol of the simulated vehicle: list, read and set, values as floats as ArduPilot sends them."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS, Kind, Parameters

TYPES: dict[Kind, int] = {
    "int8": wire.MAV_PARAM_TYPE_INT8,
    "int16": wire.MAV_PARAM_TYPE_INT16,
    "int32": wire.MAV_PARAM_TYPE_INT32,
    "float": wire.MAV_PARAM_TYPE_REAL32,
}
UNNUMBERED = 65535
"""Index of an answer to a change."""


class ParameterProtocol:
    """Says nothing about parameters that it does not have."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._names = list(parameters)

    def on_message(self, message: Any) -> list[MAVLink_message]:
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            return [self._value(name, index) for index, name in enumerate(self._names)]
        if kind == "PARAM_REQUEST_READ" and message.param_index >= 0:
            index = message.param_index
            return [self._value(self._names[index], index)] if index < len(self._names) else []
        name = getattr(message, "param_id", "")
        if name not in self._parameters:
            return []
        if kind == "PARAM_SET":
            self._parameters.set(name, message.param_value)
            return [self._value(name, UNNUMBERED)]
        return [self._value(name, self._names.index(name))] if kind == "PARAM_REQUEST_READ" else []

    def _value(self, name: str, index: int) -> MAVLink_message:
        return wire.MAVLink_param_value_message(
            name.encode(), self._parameters[name], TYPES[SPECS[name].kind], len(self._names), index
        )
