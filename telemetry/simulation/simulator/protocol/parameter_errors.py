"""PARAM_ERROR as newer firmware of both makes sends it; older firmware is silent instead."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters

HASH = "_HASH_CHECK"
"""PX4 answers to it, although it is no parameter."""


def parameter_error(message: Any, parameters: Parameters) -> Any | None:
    """What is said to the station that reads or sets what cannot be; None: nothing is wrong with it."""
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
