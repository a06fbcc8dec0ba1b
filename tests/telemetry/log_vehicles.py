"""Vehicles that serve logs as ArduPilot does, on the test's clock: one stretch at a time, a few blocks each tick."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

BLOCKS_PER_TICK = 20


class LogVehicle:
    first_number = 1

    def __init__(self, logs: list[bytes], *, begun_utc_s: int = 1_700_000_000) -> None:
        self.logs, self.begun_utc_s = logs, begun_utc_s
        self._entries: list[int] = []
        self._data: tuple[int, int, int] | None = None

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        kind = message.get_type()
        numbers = range(self.first_number, self.first_number + len(self.logs))
        if kind == "LOG_REQUEST_LIST":
            if not self.logs:
                return [mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0)]
            self._entries = [number for number in numbers if message.start <= number <= message.end]
        elif kind == "LOG_REQUEST_DATA" and message.id in numbers:
            self._data = (message.id, message.ofs, message.count)
        elif kind == "LOG_REQUEST_END":
            self._data = None
        return []

    def on_tick(self, now_s: float) -> list[Any]:
        last = self.first_number + len(self.logs) - 1
        out = [
            mavlink.MAVLink_log_entry_message(
                number, len(self.logs), last, self.begun_utc_s, len(self.logs[number - self.first_number])
            )
            for number in self._entries[:BLOCKS_PER_TICK]
        ]
        self._entries = self._entries[BLOCKS_PER_TICK:]
        for _ in range(BLOCKS_PER_TICK):
            if self._data is None:
                break
            out.append(self._block())
        return out

    def _block(self) -> Any:
        assert self._data is not None
        number, offset, count = self._data
        content = self.logs[number - self.first_number][offset : offset + min(90, count)]
        left = count - len(content)
        self._data = (number, offset + len(content), left) if len(content) == 90 and left > 0 else None
        return mavlink.MAVLink_log_data_message(number, offset, len(content), list(content.ljust(90, b"\0")))


class Px4Logs(LogVehicle):
    """Counts from 0, and answers nothing after it was told that no more is read, until it is asked for the list."""

    first_number = 0

    def __init__(self, logs: list[bytes]) -> None:
        super().__init__(logs)
        self._listed = False

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        kind = message.get_type()
        self._listed = kind == "LOG_REQUEST_LIST" or (self._listed and kind != "LOG_REQUEST_END")
        return super().on_message(message, now_s) if self._listed or kind == "LOG_REQUEST_END" else []
