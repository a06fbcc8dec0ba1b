"""A virtual clock and a radio link that loses, repeats, delays and corrupts frames between a machine and a vehicle."""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Action, Done, Failed, Send

VEHICLE, STATION = (1, 1), (255, 190)
TICK_S = 0.05


class Machine(Protocol):
    def start(self, now_s: float) -> list[Action]: ...
    def on_message(self, message: Any, now_s: float) -> list[Action]: ...
    def on_tick(self, now_s: float) -> list[Action]: ...


class Vehicle(Protocol):
    def on_message(self, message: Any, now_s: float) -> list[Any]: ...
    def on_tick(self, now_s: float) -> list[Any]: ...


@dataclass(frozen=True)
class Faults:
    """Shares of the frames in each direction."""

    loss: float = 0.0
    reordering: float = 0.0
    duplicates: float = 0.0
    corruption: float = 0.0
    latency_s: float = 0.02
    late_s: float = 0.1
    """A reordered frame comes up to this much later."""


class Codec:
    """One end's packing and parsing, with checksums."""

    def __init__(self, address: tuple[int, int]) -> None:
        self._mav = mavlink.MAVLink(None, srcSystem=address[0], srcComponent=address[1])

    def pack(self, message: Any) -> bytes:
        frame = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        return bytes(frame)

    def parse(self, frame: bytes) -> Any | None:
        try:
            return self._mav.decode(bytearray(frame))
        except mavlink.MAVError:
            return None


@dataclass
class Run:
    """A machine, a vehicle and what lies between them, on a clock of their own."""

    machine: Machine
    vehicle: Vehicle
    faults: Faults = Faults()
    seed: int = 0
    lose: Callable[[str, Any, int], bool] = lambda direction, message, number: False
    """Also lost: by direction ("up" to the vehicle, "down"), message, and number in the order of sending."""
    now_s: float = 0.0
    sent: int = 0
    actions: list[Action] = field(default_factory=list)
    log: list[tuple[float, str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        self._station, self._craft = Codec(STATION), Codec(VEHICLE)
        self._order = itertools.count()
        self._queue: list[tuple[float, int, str, bytes]] = []

    @property
    def end(self) -> Done | Failed | None:
        return next((action for action in self.actions if isinstance(action, Done | Failed)), None)

    @property
    def result(self) -> Any:
        assert isinstance(self.end, Done), self.end
        return self.end.result

    @property
    def error(self) -> Any:
        assert isinstance(self.end, Failed), self.end
        return self.end.error

    def until_end(self, *, longest_s: float = 2000.0) -> Run:
        self._do(self.machine.start(self.now_s))
        next_tick_s = TICK_S
        while self.end is None and self.now_s < longest_s:
            if self._queue and self._queue[0][0] <= next_tick_s:
                self._deliver(*heapq.heappop(self._queue))
                continue
            self.now_s, next_tick_s = next_tick_s, next_tick_s + TICK_S
            self._answer(self.vehicle.on_tick(self.now_s))
            self._do(self.machine.on_tick(self.now_s))
        return self

    def _deliver(self, at_s: float, _: int, direction: str, frame: bytes) -> None:
        self.now_s = at_s
        if direction == "up":
            message = self._craft.parse(frame)
            if message is not None:
                self._answer(self.vehicle.on_message(message, at_s))
        else:
            message = self._station.parse(frame)
            if message is not None and self.end is None:
                self._do(self.machine.on_message(message, at_s))

    def _do(self, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, Send):
                self._send("up", action.message)
            else:
                self.actions.append(action)

    def _answer(self, messages: list[Any]) -> None:
        for message in messages:
            self._send("down", message)

    def _send(self, direction: str, message: Any) -> None:
        self.log.append((self.now_s, direction, message))
        number, self.sent = self.sent, self.sent + 1
        frame = (self._station if direction == "up" else self._craft).pack(message)
        copies = 2 if self._chance(self.faults.duplicates) else 1
        for _ in range(copies):
            lost = self._chance(self.faults.loss)
            if lost or self.lose(direction, message, number):
                continue
            late_s = self._random.uniform(0, self.faults.late_s) if self._chance(self.faults.reordering) else 0.0
            at_s = self.now_s + self.faults.latency_s + late_s
            heapq.heappush(self._queue, (at_s, next(self._order), direction, self._spoil(frame)))

    def _spoil(self, frame: bytes) -> bytes:
        if not self._chance(self.faults.corruption):
            return frame
        spoilt = bytearray(frame)
        spoilt[self._random.randrange(len(spoilt))] ^= 1 << self._random.randrange(8)
        return bytes(spoilt)

    def _chance(self, share: float) -> bool:
        return share > 0 and self._random.random() < share
