"""Reading single parameters of the vehicle, sans-IO."""

from __future__ import annotations

import math
import struct

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Send

ASK_AGAIN_S = 0.3
TRIES = 12
"""Over a link that loses 30 % in each direction one value in 3,000 is not heard then; with 5 it was one in 30."""
NAME_BYTES = 16
_INTEGER_FORMATS = {1: "<B3x", 2: "<b3x", 3: "<H2x", 4: "<h2x", 5: "<I", 6: "<i"}
"""struct formats of MAV_PARAM_TYPE 1 to 6 within the four bytes of a float."""
BYTEWISE = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE


class ParameterRead:
    """Ends in Done(dict name -> value, None for what the vehicle does not have). SilentError: nothing came at all.

    ``bytewise``: integers stand in the float's four bytes as they are (PX4, MAVSDK), not as a number (ArduPilot).
    """

    def __init__(self, names: tuple[str, ...], *, target: tuple[int, int], bytewise: bool) -> None:
        self._target, self._bytewise = target, bytewise
        self._values: dict[str, float | None] = dict.fromkeys(names)
        self._open = [name for name in names if 0 < len(name.encode()) <= NAME_BYTES]
        self._tries, self._asked_s = 0, 0.0
        self._heard = False

    def start(self, now_s: float) -> list[Action]:
        return self._ask(now_s)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if (message.get_srcSystem(), message.get_srcComponent()) != self._target:
            return []
        self._heard = True
        if message.get_type() == "PARAM_VALUE":
            return self._settle(message.param_id, parameter_value(message, bytewise=self._bytewise))
        if message.get_type() == "PARAM_ERROR" and message.error == mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST:
            return self._settle(message.param_id, None)
        return []

    def on_tick(self, now_s: float) -> list[Action]:
        if not self._open or now_s - self._asked_s < ASK_AGAIN_S:
            return []
        if self._tries < TRIES:
            return self._ask(now_s)
        if self._heard:
            return self._finish()
        names = ", ".join(self._values)
        self._open = []
        return [Failed(SilentError(f"The vehicle is silent: {names} could not be read.", advice="Check the link."))]

    def _ask(self, now_s: float) -> list[Action]:
        self._tries, self._asked_s = self._tries + 1, now_s
        if not self._open:
            return self._finish()
        return [
            Send(mavlink.MAVLink_param_request_read_message(*self._target, name.encode(), -1)) for name in self._open
        ]

    def _settle(self, name: str, value: float | None) -> list[Action]:
        if name not in self._open:
            return []
        self._values[name] = value
        self._open.remove(name)
        return [] if self._open else self._finish()

    def _finish(self) -> list[Action]:
        self._open = []
        return [Done(dict(self._values))]


def parameter_value(message: Message, *, bytewise: bool) -> float | None:
    """Of a PARAM_VALUE."""
    value = message.param_value
    layout = _INTEGER_FORMATS.get(message.param_type)
    if bytewise and layout is not None:
        return float(struct.unpack(layout, struct.pack("<f", value))[0])
    return float(value) if math.isfinite(value) else None
