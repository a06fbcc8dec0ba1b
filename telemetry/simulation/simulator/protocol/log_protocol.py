"""The vehicle's logs for ground stations: to one station at a time, and while disarmed."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.own_logs.keeping import OwnLogs
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
        kind, numbers = message.get_type(), self._numbers
        if self._vehicle.autopilot.armed:
            if words := self._own.writer.words_while_armed:
                self._vehicle.autopilot.say(3, words)
        elif kind == "LOG_REQUEST_LIST":
            wanted = range(max(numbers.start, message.start), min(numbers.stop, message.end + 1))
            self._entries = (peer, wanted if numbers else range(1))
        elif kind == "LOG_REQUEST_DATA" and message.id in numbers and self._is_free_for(peer):
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

    @property
    def _numbers(self) -> range:
        first = self._own.writer.first_number
        return range(first, first + len(self._own.logs))

    def _is_free_for(self, peer: Hashable) -> bool:
        return self._data is None or self._data[0] == peer

    def _entry(self, number: int) -> Any:
        numbers = self._numbers
        if number not in numbers:
            return wire.MAVLink_log_entry_message(0, 0, 0, 0, 0)
        log = self._own.logs[number - numbers.start]
        begun_utc_s, size = int(log.begun_utc_s), len(log.content)
        return wire.MAVLink_log_entry_message(number, len(numbers), numbers.stop - 1, begun_utc_s, size)

    def _block(self, peer: Hashable, number: int, offset: int, left: int) -> Reply:
        content = bytes(self._own.logs[number - self._numbers.start].content[offset : offset + min(BLOCK_BYTES, left)])
        goes_on = len(content) == BLOCK_BYTES and left > BLOCK_BYTES
        self._data = (peer, number, offset + BLOCK_BYTES, left - BLOCK_BYTES) if goes_on else None
        padded = list(content.ljust(BLOCK_BYTES, b"\0"))
        return peer, wire.MAVLink_log_data_message(number, offset, len(content), padded)
