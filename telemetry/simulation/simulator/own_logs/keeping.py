"""The simulated vehicle's own logs: one for each time it was armed, written as its autopilot's make writes them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from telemetry.simulation.simulator.autopilot.pilot import Event
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

EVERY_S = 0.1
MOST_LOGS, MOST_BYTES = 20, 16 << 20
"""Then the oldest goes, and nothing more is written into one."""


class LogWriter(Protocol):
    """Each method returns what is to be written."""

    folder: str
    """In which all logs lie, as MAVLink FTP names it."""
    first_number: int
    """Of the list that LOG_REQUEST_LIST asks for."""
    words_while_armed: str
    """Said to who asks for logs then; empty: nothing is."""

    @property
    def is_wanted(self) -> bool:
        """By the vehicle's parameters."""
        ...

    def path(self, number: int, begun_utc_s: float, /) -> str: ...
    def head(self) -> bytes: ...
    def mode(self) -> bytes:
        """A mode that has just been changed to."""
        ...

    def sample(self) -> bytes: ...
    def event(self, event: Event) -> bytes: ...
    def end(self) -> bytes: ...


MakeWriter = Callable[[SimulatedVehicle, float], LogWriter]
"""The number is UTC less the time since switching on."""


@dataclass(slots=True)
class SimulatedLog:
    begun_utc_s: float
    content: bytearray = field(default_factory=bytearray)


class OwnLogs:
    def __init__(self, vehicle: SimulatedVehicle, make: MakeWriter) -> None:
        self._vehicle, self._started_utc_s = vehicle, time.time()
        self.writer = make(vehicle, self._started_utc_s)
        self._was_armed = self._is_open = False
        self._mode, self._written_s = "", 0.0
        self.logs: list[SimulatedLog] = []

    @property
    def files(self) -> dict[str, bytearray]:
        """By their paths."""
        return {self.writer.path(number, log.begun_utc_s): log.content for number, log in enumerate(self.logs, start=1)}

    def look(self) -> None:
        """After everything that may have armed or disarmed the vehicle."""
        armed = self._vehicle.autopilot.armed
        if armed == self._was_armed:
            return
        self._was_armed = armed
        if armed and self.writer.is_wanted:
            self._begin()
        elif self._is_open:
            self._write(self.writer.end())
            self._is_open = False

    def on_slice(self) -> None:
        """After each slice of simulated time."""
        vehicle = self._vehicle
        self.look()
        if not self._is_open:
            return
        if vehicle.autopilot.mode.name != self._mode:
            self._mode = vehicle.autopilot.mode.name
            self._write(self.writer.mode())
        if vehicle.now_s - self._written_s >= EVERY_S:
            self._written_s = vehicle.now_s
            self._write(self.writer.sample())

    def on_event(self, event: Event) -> None:
        if self._is_open:
            self._write(self.writer.event(event))

    def _begin(self) -> None:
        begun_utc_s = self._started_utc_s + self._vehicle.now_s
        if self.logs:  # files are named by whole seconds
            begun_utc_s = max(begun_utc_s, self.logs[-1].begun_utc_s + 1.0)
        self.logs = [*self.logs[-MOST_LOGS + 1 :], SimulatedLog(begun_utc_s)]
        self._is_open, self._mode = True, ""
        self._write(self.writer.head())

    def _write(self, content: bytes) -> None:
        if len(self.logs[-1].content) <= MOST_BYTES:
            self.logs[-1].content += content
