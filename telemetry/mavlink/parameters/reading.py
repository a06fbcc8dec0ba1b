"""Reading single parameters of the vehicle, sans-IO."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Send
from telemetry.mavlink.parameters.values import parameter_value
from telemetry.topics.parameters import NAME_BYTES

ASK_AGAIN_S = 0.3
TRIES = 12
"""Over a link that loses 30 % in each direction one value in 3,000 is not heard then; with 5 it was one in 30."""


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
