"""The logs on the adopted vehicle: their list, and one stretch of one log at a time, on the ground only."""

from __future__ import annotations

import asyncio

from telemetry.errors import NotAllowedError
from telemetry.link.adopted import AdoptedVehicle
from telemetry.mavlink.logs.listing import LogListRead
from telemetry.mavlink.logs.on_the_ground import refuse_in_flight
from telemetry.mavlink.logs.reading import LogRead
from telemetry.topics.requests import ReadVehicleLog
from telemetry.topics.vehicle_logs import MOST_BYTES, VehicleLog


class LogReading:
    """One at a time: a vehicle sends one log, to one station. A mission that is transferred goes before."""

    def __init__(self, vehicle: AdoptedVehicle) -> None:
        self._vehicle = vehicle
        self._machine: LogListRead | LogRead | None = None
        self._reading = asyncio.Lock()

    async def list(self) -> tuple[VehicleLog, ...]:
        found = await self._run(LogListRead(target=self._vehicle.target))
        assert isinstance(found, tuple)
        return found

    async def read(self, request: ReadVehicleLog) -> bytes:
        if not 0 < request.size <= MOST_BYTES:
            what = f"{request.size} bytes of a log were asked for at once."
            raise NotAllowedError(what, advice=f"Ask for 1 to {MOST_BYTES}.")
        machine = LogRead(
            request.number, request.offset, request.size, is_last=request.is_last, target=self._vehicle.target
        )
        content = await self._run(machine)
        assert isinstance(content, bytes)
        return content

    def give_way(self) -> None:
        """Something that a flight needs is about to be transferred."""
        if self._machine is not None:
            self._vehicle.exchanges.perform(self._machine, self._machine.cancel())

    async def _run(self, machine: LogListRead | LogRead) -> object:
        async with self._reading:
            refuse_in_flight(self._vehicle.state)
            self._machine = machine
            try:
                return await self._vehicle.exchanges.run(machine)
            finally:
                self._machine = None
