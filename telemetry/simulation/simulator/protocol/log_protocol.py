"""The vehicle's logs for ground stations, as ArduPilot hands them out: to one station at a time, and while disarmed."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.own_log import OwnLogs
from telemetry.simulation.simulator.protocol.item_protocol import Reply
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

EVERY_S, BLOCKS = 0.02, 20
BLOCK_BYTES = 90


class LogProtocol:
    def __init__(self, vehicle: SimulatedVehicle, own: OwnLogs) -> None:
        self._vehicle, self._own = vehicle, own
        self._entries: tuple[Hashable, range] | None = None
        self._data: tuple[Hashable, int, int, int] | None = None
        """To whom, which log, from where on, how many bytes more."""
        self._sent_s = 0.0

    def on_message(self, message: Any, peer: Hashable) -> None:
        kind, count = message.get_type(), len(self._own.logs)
        if self._vehicle.autopilot.armed:
            self._vehicle.autopilot.say(3, "Disarm for log download")
        elif kind == "LOG_REQUEST_LIST":
            self._entries = (peer, range(max(1, message.start), min(count, message.end) + 1) if count else range(1))
        elif kind == "LOG_REQUEST_DATA" and 1 <= message.id <= count and self._is_free_for(peer):
            self._data = (peer, message.id, message.ofs, message.count)
        elif kind == "LOG_REQUEST_END" and self._is_free_for(peer):
            self._data = None

    def on_tick(self, wall_s: float) -> list[Reply]:
        if self._vehicle.autopilot.armed:
            self._entries = self._data = None
        if wall_s - self._sent_s < EVERY_S or (self._entries is None and self._data is None):
            return []
        self._sent_s = wall_s
        out: list[Reply] = []
        if self._entries is not None:
            peer, numbers = self._entries
            out += [(peer, self._entry(number)) for number in numbers[:BLOCKS]]
            self._entries = (peer, numbers[BLOCKS:]) if len(numbers) > BLOCKS else None
        for _ in range(BLOCKS):
            if self._data is not None:
                out.append(self._block(*self._data))
        return out

    def forget(self, peer: Hashable) -> None:
        if self._entries is not None and self._entries[0] == peer:
            self._entries = None
        if self._data is not None and self._data[0] == peer:
            self._data = None

    def _is_free_for(self, peer: Hashable) -> bool:
        return self._data is None or self._data[0] == peer

    def _entry(self, number: int) -> Any:
        logs = self._own.logs
        if not number:
            return wire.MAVLink_log_entry_message(0, 0, 0, 0, 0)
        log = logs[number - 1]
        return wire.MAVLink_log_entry_message(number, len(logs), len(logs), int(log.begun_utc_s), len(log.content))

    def _block(self, peer: Hashable, number: int, offset: int, left: int) -> Reply:
        content = bytes(self._own.logs[number - 1].content[offset : offset + min(BLOCK_BYTES, left)])
        goes_on = len(content) == BLOCK_BYTES and left > BLOCK_BYTES
        self._data = (peer, number, offset + BLOCK_BYTES, left - BLOCK_BYTES) if goes_on else None
        padded = list(content.ljust(BLOCK_BYTES, b"\0"))
        return peer, wire.MAVLink_log_data_message(number, offset, len(content), padded)
