"""Reading a stretch of one log, sans-IO: blocks stream in, and what was lost is asked for again."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError, TelemetryError, TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Send
from telemetry.mavlink.conversation import Endpoints, RoundTrip
from telemetry.mavlink.logs.on_the_ground import armed_meanwhile
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import BLOCK_BYTES

SILENT_S = 15.0
"""A vehicle may have to look for a log on its card first."""
LONGEST_S = 300.0
NEAR_BLOCKS = 8
"""Gaps that lie no farther apart are asked for in one: what is sent twice takes less time than another question."""


class LogRead:
    """Ends in Done(bytes): of ``size`` bytes from ``offset`` on what the log has, fewer only where it ends."""

    def __init__(self, number: int, offset: int, size: int, *, is_last: bool, target: tuple[int, int]) -> None:
        """``is_last``: the vehicle is told that no more is read. PX4 answers nothing more after that."""
        self._number, self._offset, self._size, self._is_last = number, offset, size, is_last
        self._endpoints = Endpoints(target)
        self._round_trip = RoundTrip(unknown_s=0.5, shortest_s=0.3, longest_s=1.0)
        self._content = bytearray(size)
        self._missing = dict.fromkeys(range(0, size, BLOCK_BYTES))
        """Where each block begins that has not come, in their order."""
        self._asked_until = 0
        self._asked_s = self._heard_s = self._came_s = self._started_s = 0.0
        self._answered, self._over = True, False

    def start(self, now_s: float) -> list[Action]:
        self._started_s = self._heard_s = self._came_s = now_s
        return self._ask(now_s)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self._over or message.get_type() != "LOG_DATA" or not self._endpoints.is_from_vehicle(message):
            return []
        at = message.ofs - self._offset
        if message.id != self._number or not 0 <= at < len(self._content) or at % BLOCK_BYTES:
            return []
        self._heard_s = now_s
        if not self._answered:
            self._round_trip.measure(now_s - self._asked_s)
            self._answered = True
        self._keep(at, message.count, bytes(message.data), now_s)
        if not self._missing:
            return self._end(Done(bytes(self._content)))
        return self._ask(now_s) if at + BLOCK_BYTES >= self._asked_until else []

    def _keep(self, at: int, count: int, data: bytes, now_s: float) -> None:
        """A block that is not full is where the log ends."""
        wanted = min(BLOCK_BYTES, len(self._content) - at)
        if count < wanted:
            del self._content[at + count :]
            self._missing = {begin: None for begin in self._missing if begin < at}
        if at in self._missing:
            del self._missing[at]
        elif count >= wanted:
            return
        self._content[at : at + min(count, wanted)] = data[: min(count, wanted)]
        self._came_s = now_s

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        return [] if self._over or not state.armed else self._end(Failed(armed_meanwhile()))

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over:
            return []
        if now_s - self._came_s > SILENT_S or now_s - self._started_s > LONGEST_S:
            return self._end(Failed(self._gap()))
        if now_s - max(self._heard_s, self._asked_s) < self._round_trip.patience_s:
            return []
        self._round_trip.repeats()
        return self._ask(now_s)

    def cancel(self) -> list[Action]:
        advice = "Read the log again when it is over."
        error = TransferError("Reading the log was ended: a mission is being transferred.", advice=advice)
        return [] if self._over else self._end(Failed(error))

    def _ask(self, now_s: float) -> list[Action]:
        """For the first gap, and those that lie near behind it."""
        if not self._missing:
            return self._end(Done(bytes(self._content)))
        begins = iter(self._missing)
        first = last = next(begins)
        for begin in begins:
            if begin - last > NEAR_BLOCKS * BLOCK_BYTES:
                break
            last = begin
        self._asked_until = min(last + BLOCK_BYTES, len(self._content))
        self._asked_s, self._answered = now_s, False
        count = self._asked_until - first
        where = (self._number, self._offset + first, count)
        return [Send(mavlink.MAVLink_log_request_data_message(*self._endpoints.vehicle, *where))]

    def _gap(self) -> TelemetryError:
        if len(self._missing) * BLOCK_BYTES >= self._size:
            advice = "Ask for the list again: it may be gone. Check the link."
            return SilentError(f"The vehicle sends nothing of log {self._number}.", advice=advice)
        what = f"{len(self._missing)} blocks of log {self._number} did not come."
        return TransferError(what, advice="Check the link, then read it again.")

    def _end(self, end: Done | Failed) -> list[Action]:
        self._over = True
        tells = self._is_last or isinstance(end, Failed)
        told = [Send(mavlink.MAVLink_log_request_end_message(*self._endpoints.vehicle))] if tells else []
        return [*told, end]
