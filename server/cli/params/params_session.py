"""With one vehicle: its list read, its values written in batches, and what became of each."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from server.cli.shared.output import say
from server.cli.shared.own_nodes import OPERATOR, own_nodes
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError, SilentError, TelemetryError
from telemetry.flight.preflight.prepare import connect
from telemetry.flight.watch import watching
from telemetry.topics.parameters import MOST_CHANGES, Parameter, ParameterChange, ParameterWritten
from telemetry.topics.requests import ListParameters, ReadParameters, WriteParameters
from telemetry.topics.vehicle import VehicleState

MOST_NAMES = 10
"""Asked for at once: ArduPilot keeps 20 questions and drops what comes above, which would look as if it had no such
parameter."""
Told = Callable[[ParameterWritten], None]


@dataclass(frozen=True, slots=True)
class ParameterSession:
    link: LinkClient
    vehicle: VehicleState

    @property
    def title(self) -> str:
        return (
            f"vehicle {self.vehicle.system_id}, {self.vehicle.autopilot} {self.vehicle.firmware_version or ''}".rstrip()
        )

    async def whole_list(self) -> tuple[Parameter, ...]:
        say("Reading all parameters")
        parameters = (await self.link.call(ListParameters())).parameters
        say(f"Read {len(parameters)} parameters")
        return parameters

    async def named(self, names: Sequence[str]) -> dict[str, float | None]:
        """None for what the vehicle does not have or does not answer to."""
        found: dict[str, float | None] = {}
        for begin in range(0, len(names), MOST_NAMES):
            found |= await self.link.call(ReadParameters(tuple(names[begin : begin + MOST_NAMES])))
        return found

    async def write(
        self, changes: Sequence[ParameterChange], told: Told, *, even_armed: bool, begun: bool = False
    ) -> list[ParameterWritten]:
        """``told`` hears of each when its batch is over. Raises what the link raises of the first batch, unless others
        were written before (``begun``): what became of those must be told."""
        written: list[ParameterWritten] = []
        for begin in range(0, len(changes), MOST_CHANGES):
            batch = tuple(changes[begin : begin + MOST_CHANGES])
            try:
                made = await self.link.call(WriteParameters(OPERATOR, batch, even_armed))
            except TelemetryError as error:
                if not (begun or written):
                    raise
                return [*written, *_lost(error, batch, changes[begin + len(batch) :], told)]
            for one in made:
                told(one)
            written += made
            if made[-1].outcome == "not sent":
                return [*written, *_unsent(changes[begin + len(batch) :], made[-1].words, told)]
        return written


def _lost(
    error: TelemetryError, batch: Sequence[ParameterChange], rest: Sequence[ParameterChange], told: Told
) -> list[ParameterWritten]:
    """A batch that ended in an error, and those behind it."""
    if isinstance(error, NotAllowedError | SilentError):
        return _unsent((*batch, *rest), str(error), told)
    made = [ParameterWritten(c.name, c.value, None, None, "unknown", str(error)) for c in batch]
    for one in made:
        told(one)
    return [*made, *_unsent(rest, str(error), told)]


def _unsent(changes: Sequence[ParameterChange], words: str, told: Told) -> list[ParameterWritten]:
    made = [ParameterWritten(c.name, c.value, None, None, "not sent", words) for c in changes]
    for one in made:
        told(one)
    return made


@asynccontextmanager
async def parameter_session(link: str, data_dir: Path | None) -> AsyncIterator[ParameterSession]:
    """Connects, and adopts the first vehicle heard. Raises NoVehicleError, ConnectionFailedError."""
    async with own_nodes(recorder=False, data_dir=data_dir) as station, watching(station.bus) as watch:
        vehicle = await connect(station.link, watch, link, OPERATOR, say)
        yield ParameterSession(station.link, vehicle)
