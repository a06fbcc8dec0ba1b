"""Asking a vehicle where its own file about itself lies (COMPONENT_METADATA), sans-IO."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.mav_cmd import MavCmd
from telemetry.errors import RefusedError, SilentError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Send
from telemetry.mavlink.conversation import Endpoints
from telemetry.mavlink.texts.event_messages import ComponentMetadata

ASK_AGAIN_S = 0.5
TRIES = 6
ACCEPTED = 0
REFUSALS = 2
"""A refusal does not say of which message: it may be of another one that was asked for at the same time."""


class MetadataAsk:
    """Ends in Done((URI, CRC-32)) of the general file; RefusedError: it has none."""

    def __init__(self, *, target: tuple[int, int]) -> None:
        self._endpoints = Endpoints(target)
        self._tries, self._refusals, self._asked_s, self._over = 0, 0, 0.0, False

    def start(self, now_s: float) -> list[Action]:
        return self._ask(now_s)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        del now_s
        if self._over or not self._endpoints.is_from_vehicle(message):
            return []
        if message.get_type() == "COMPONENT_METADATA":
            uri = bytes(message.uri).split(b"\0")[0].decode("ascii", errors="replace")
            return self._end(Done((uri, message.file_crc)))
        is_ours = message.get_type() == "COMMAND_ACK" and message.command == MavCmd.REQUEST_MESSAGE
        if is_ours and self._endpoints.is_for_us(message) and message.result != ACCEPTED:
            self._refusals += 1
        return []

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over or now_s - self._asked_s < ASK_AGAIN_S:
            return []
        if self._refusals >= REFUSALS:
            return self._end(Failed(RefusedError("The vehicle has no description of itself.", advice="")))
        if self._tries < TRIES:
            return self._ask(now_s)
        what = "The vehicle does not say whether it has a description of itself."
        return self._end(Failed(SilentError(what, advice="Check the link.")))

    def _ask(self, now_s: float) -> list[Action]:
        self._tries, self._asked_s = self._tries + 1, now_s
        request = (MavCmd.REQUEST_MESSAGE, 0, ComponentMetadata.id, 0, 0, 0, 0, 0, 0)
        return [Send(mavlink.MAVLink_command_long_message(*self._endpoints.vehicle, *request))]

    def _end(self, end: Done | Failed) -> list[Action]:
        self._over = True
        return [end]
