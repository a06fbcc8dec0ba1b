"""A vehicle's events in their order, the lost ones asked for again; sans-IO.

The vehicle numbers its events and says from time to time which is the newest. What is missing is asked for at once
and then again ever later; what the vehicle has no more, or does not give, counts as lost and holds up nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from telemetry.mavlink.actions import Message
from telemetry.mavlink.conversation import GROUND_STATION
from telemetry.mavlink.texts.event_messages import RESET, RequestEvent

NUMBERS = 1 << 16
MOST_MISSING = 64
"""More than vehicles keep: a wider gap is a new beginning."""
FIRST_PATIENCE_S, LONGEST_PATIENCE_S = 0.5, 2.0
MOST_REQUESTS = 6


@dataclass(frozen=True, slots=True)
class VehicleEvent:
    id: int
    severity: int
    """MAV_SEVERITY, or more for what is not meant for people."""
    arguments: bytes

    @classmethod
    def of(cls, message: Message) -> VehicleEvent:
        """Of an EVENT."""
        return cls(message.id, message.log_levels & 15, bytes(message.arguments))


@dataclass(frozen=True, slots=True)
class LostEvents:
    count: int


class EventReader:
    def __init__(self, vehicle: tuple[int, int], own: tuple[int, int] = GROUND_STATION) -> None:
        self._vehicle, self._own = vehicle, own
        self._next: int | None = None
        """The number of the event that is given out next; None: whichever comes."""
        self._end = 0
        """One behind the newest that the vehicle is known to have sent."""
        self._early: dict[int, VehicleEvent] = {}
        self._asked_s, self._requests = -math.inf, 0
        self._out: list[VehicleEvent | LostEvents] = []
        self._to_send: list[Message] = []

    def on_message(self, message: Message, now_s: float) -> list[VehicleEvent | LostEvents]:
        kind = message.get_type()
        if kind == "EVENT" and self._concerns(message.destination_system, message.destination_component):
            self._on_event(message)
        elif kind == "CURRENT_EVENT_SEQUENCE":
            self._on_current(message)
        elif kind == "RESPONSE_EVENT_ERROR" and self._concerns(message.target_system, message.target_component):
            self._on_error(message)
        return self._give_out(now_s)

    def on_tick(self, now_s: float) -> list[VehicleEvent | LostEvents]:
        """At infinity: nothing is waited for any more."""
        return self._give_out(now_s)

    def take_requests(self) -> list[Message]:
        """What is to be sent to the vehicle."""
        requests, self._to_send = self._to_send, []
        return requests

    def _concerns(self, system: int, component: int) -> bool:
        return system in (0, self._own[0]) and component in (0, self._own[1])

    def _on_event(self, message: Message) -> None:
        number = message.sequence
        if self._next is None or MOST_MISSING < _after(self._next, number) < NUMBERS - MOST_MISSING:
            self._begin(number)
        assert self._next is not None
        if _after(self._next, number) < NUMBERS // 2:
            self._early[number] = VehicleEvent.of(message)
            self._knows(number)

    def _on_current(self, message: Message) -> None:
        if message.flags & RESET:
            if self._next != (message.sequence + 1) % NUMBERS:
                self._next = None
                self._early.clear()
            return
        behind = (message.sequence + 1) % NUMBERS
        if self._next is None or MOST_MISSING < _after(self._next, behind) < NUMBERS - MOST_MISSING:
            self._begin(behind)
        elif _after(self._next, behind) < NUMBERS // 2:
            self._knows(message.sequence)

    def _on_error(self, message: Message) -> None:
        if self._next is None or message.sequence != self._next or self._next in self._early:
            return
        skipped = _after(self._next, message.sequence_oldest_available)
        self._skip(skipped if 0 < skipped <= MOST_MISSING else 1)

    def _begin(self, number: int) -> None:
        self._next = self._end = number
        self._early.clear()
        self._asked_s, self._requests = -math.inf, 0

    def _knows(self, number: int) -> None:
        assert self._next is not None
        if _after(self._next, number) >= _after(self._next, self._end):
            self._end = (number + 1) % NUMBERS

    def _missing(self) -> int:
        """How many before the first that is here, or before the end."""
        assert self._next is not None
        return min(_after(self._next, number) for number in (*self._early, self._end))

    def _skip(self, count: int) -> None:
        assert self._next is not None
        count = min(count, self._missing())
        if count:
            self._out.append(LostEvents(count))
            self._next = (self._next + count) % NUMBERS
            self._asked_s, self._requests = -math.inf, 0

    def _give_out(self, now_s: float) -> list[VehicleEvent | LostEvents]:
        while self._next is not None and self._next != self._end:
            if self._next in self._early:
                self._out.append(self._early.pop(self._next))
                self._next = (self._next + 1) % NUMBERS
                self._asked_s, self._requests = -math.inf, 0
            elif not self._asks(now_s):
                break
        out, self._out = self._out, []
        return out

    def _asks(self, now_s: float) -> bool:
        """For what is missing, when its time has come; True: nobody waits for it any more."""
        if now_s - self._asked_s < min(FIRST_PATIENCE_S * 2 ** max(0, self._requests - 1), LONGEST_PATIENCE_S):
            return False
        missing = self._missing()
        if self._requests == MOST_REQUESTS or now_s == math.inf:
            self._skip(missing)
            return True
        assert self._next is not None
        self._asked_s, self._requests = now_s, self._requests + 1
        self._to_send.append(RequestEvent(*self._vehicle, self._next, (self._next + missing - 1) % NUMBERS))
        return False


def _after(first: int, second: int) -> int:
    """How many numbers further the second is; they begin again at 0."""
    return (second - first) % NUMBERS
