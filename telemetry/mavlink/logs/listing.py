"""Reading the list of a vehicle's logs, sans-IO: entries stream in, what was lost is asked for by its number."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import SilentError, TelemetryError, TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send
from telemetry.mavlink.conversation import Endpoints, RoundTrip
from telemetry.mavlink.logs.on_the_ground import armed_meanwhile
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import VehicleLog

ALL = 0xFFFF
SILENT_S = 30.0
"""A vehicle with many logs looks at each before it answers."""
LONGEST_S = 300.0
_EARLIEST_UTC_S = 946_684_800
"""The year 2000: vehicles that never knew the time say less."""


class LogListRead:
    """Ends in Done(tuple[VehicleLog, ...]), the newest first."""

    def __init__(self, *, target: tuple[int, int]) -> None:
        self._endpoints = Endpoints(target)
        self._round_trip = RoundTrip(unknown_s=1.0, shortest_s=0.5, longest_s=2.0)
        self._numbers: range | None = None
        self._found: dict[int, VehicleLog] = {}
        """Of ``_numbers`` only."""
        self._started_s = self._heard_s = self._asked_s = 0.0
        self._over = False

    def start(self, now_s: float) -> list[Action]:
        self._started_s = self._heard_s = now_s
        return self._ask(0, ALL, now_s)

    def _ask(self, first: int, last: int, now_s: float) -> list[Action]:
        self._asked_s = now_s
        return [Send(mavlink.MAVLink_log_request_list_message(*self._endpoints.vehicle, first, last))]

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self._over or message.get_type() != "LOG_ENTRY" or not self._endpoints.is_from_vehicle(message):
            return []
        self._heard_s = now_s
        self._count(range(max(0, message.last_log_num - message.num_logs + 1), message.last_log_num + 1))
        if not message.num_logs:
            return self._finish()
        if message.id in self._numbers:
            begun = message.time_utc if message.time_utc > _EARLIEST_UTC_S else None
            self._found[message.id] = VehicleLog(message.id, message.size, begun)
        if self._missing:
            return [Progress("reading", len(self._found), message.num_logs)]
        return self._finish()

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        return [] if self._over or not state.armed else self._fail(armed_meanwhile())

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over:
            return []
        if now_s - self._heard_s > SILENT_S or now_s - self._started_s > LONGEST_S:
            return self._fail(self._gap())
        quiet_s = self._round_trip.patience_s
        if now_s - max(self._heard_s, self._asked_s) < quiet_s:
            return []
        self._round_trip.repeats()
        if self._numbers is None:
            return self._ask(0, ALL, now_s)
        first = next(n for n in self._numbers if n not in self._found)
        last = next((n for n in range(first, self._numbers.stop) if n in self._found), self._numbers.stop) - 1
        return self._ask(first, last, now_s)

    def cancel(self) -> list[Action]:
        return [] if self._over else self._fail(TransferError("Reading the list of logs was cancelled.", advice=""))

    def _count(self, numbers: range) -> None:
        """Of a list that has changed meanwhile, too: its numbers are those of the newest entry."""
        if numbers != self._numbers:
            self._numbers = numbers
            self._found = {number: log for number, log in self._found.items() if number in numbers}

    @property
    def _missing(self) -> int:
        """How many; a vehicle may say that it has 65,535."""
        return len(self._numbers or ()) - len(self._found)

    def _finish(self) -> list[Action]:
        self._over = True
        found = tuple(self._found[number] for number in reversed(self._numbers or range(0)))
        return [Send(mavlink.MAVLink_log_request_end_message(*self._endpoints.vehicle)), Done(found)]

    def _gap(self) -> SilentError | TransferError:
        if self._numbers is None:
            advice = "Check the link. Some vehicles keep no logs, or have no card to keep them on."
            return SilentError("The vehicle does not say which logs it has.", advice=advice)
        what = f"{self._missing} of {len(self._numbers)} entries of the vehicle's list of logs did not come."
        return TransferError(what, advice="Check the link, then ask again.")

    def _fail(self, error: TelemetryError) -> list[Action]:
        self._over = True
        return [Send(mavlink.MAVLink_log_request_end_message(*self._endpoints.vehicle)), Failed(error)]
