"""Runs protocol machines against the adopted vehicle: feeds them messages and ticks, sends what they ask for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from telemetry.errors import NoVehicleError, TelemetryError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send
from telemetry.topics.vehicle import VehicleState


class Machine(Protocol):
    def start(self, now_s: float) -> list[Action]: ...
    def on_message(self, message: Message, now_s: float) -> list[Action]: ...
    def on_tick(self, now_s: float) -> list[Action]: ...


@runtime_checkable
class WatchesState(Protocol):
    def on_state(self, state: VehicleState, now_s: float) -> list[Action]: ...


class _Running:
    def __init__(self, machine: Machine, progress: Callable[[Progress], None] | None) -> None:
        self.machine = machine
        self.progress = progress
        self.result: asyncio.Future[object] = asyncio.get_running_loop().create_future()


class Exchanges:
    def __init__(self, send: Callable[[Message], None], clock: Callable[[], float]) -> None:
        self._send, self._clock = send, clock
        self._running: list[_Running] = []

    async def run(self, machine: Machine, *, progress: Callable[[Progress], None] | None = None) -> object:
        """The machine's result; raises its error. Ends with NoVehicleError when the vehicle is given up."""
        running = _Running(machine, progress)
        self._running.append(running)
        try:
            self._perform(running, machine.start(self._clock()))
            return await running.result
        finally:
            self._running.remove(running)

    def perform(self, machine: Machine, actions: list[Action]) -> None:
        """What a running machine asks for besides: it was told to pause, to go on or to stop."""
        for running in self._running:
            if running.machine is machine:
                self._perform(running, actions)

    def on_message(self, message: Message) -> None:
        now_s = self._clock()
        for running in tuple(self._running):
            if not running.result.done():
                self._perform(running, running.machine.on_message(message, now_s))

    def on_state(self, state: VehicleState) -> None:
        """For the machines that settle by what the vehicle's state shows."""
        now_s = self._clock()
        for running in tuple(self._running):
            if isinstance(running.machine, WatchesState) and not running.result.done():
                self._perform(running, running.machine.on_state(state, now_s))

    def on_tick(self) -> None:
        now_s = self._clock()
        for running in tuple(self._running):
            if not running.result.done():
                self._perform(running, running.machine.on_tick(now_s))

    def give_up(self, error: TelemetryError | None = None) -> None:
        """The vehicle they talk to is not ours any more."""
        for running in tuple(self._running):
            self._end(running, error or NoVehicleError("The vehicle was given up.", advice="Adopt a vehicle first."))

    def _perform(self, running: _Running, actions: list[Action]) -> None:
        for action in actions:
            if isinstance(action, Send):
                self._send(action.message)
            elif isinstance(action, Progress):
                if running.progress is not None:
                    running.progress(action)
            elif isinstance(action, Failed):
                self._end(running, action.error)
            elif isinstance(action, Done) and not running.result.done():
                running.result.set_result(action.result)

    def _end(self, running: _Running, error: TelemetryError) -> None:
        if not running.result.done():
            running.result.set_exception(error)
