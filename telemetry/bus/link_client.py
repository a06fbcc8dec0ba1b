"""Asks the link node over the bus: every request of ``telemetry.topics.requests``, its answer with its type."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import Any, overload

from telemetry.bus.bus import Bus
from telemetry.bus.liveness import Liveness
from telemetry.bus.node_lock import running_node, silence_counts
from telemetry.errors import BusError, OvertakenError, TransferError
from telemetry.topics.onboard_lists import Item, OnboardMission, UploadReport
from telemetry.topics.parameters import ParameterList, ParameterWritten, VehicleMetadata
from telemetry.topics.requests import (
    Connect,
    Download,
    DownloadPlaces,
    FlyWay,
    HighestToken,
    LinkRequest,
    ListParameters,
    ListVehicleLogs,
    Looks,
    MayFlyManoeuvre,
    Operator,
    ReadMetadata,
    ReadParameters,
    ReadVehicleLog,
    StartAuto,
    StartGuided,
    Upload,
    UploadPlaces,
    WriteParameters,
)
from telemetry.topics.vehicle_logs import MOST_BYTES, VehicleLog

NAME = "link"
COMMAND_S = 30.0
"""A command is given up by the link itself after about half of this."""
START_S = 90.0
"""Modes, arming and take-off, one after the other."""
DOWNLOAD_S = 180.0
UPLOAD_S, UPLOAD_PER_ITEM_S = 240.0, 5.0
LOGS_S = 510.0
"""Their list, or one stretch of one."""
LIST_S, WRITE_S, WRITE_PER_CHANGE_S = 630.0, 30.0, 20.0
APPEARS_S = 0.5
"""A link node that is there is found by then; only ``Connect`` waits for one that is being started."""
HUNG_S, LOOK_EVERY_S = 0.9, 0.1
OVERTAKEN_TRIES = 5
TRANSMITTER = "Take the transmitter if the vehicle must act now."
_ANSWERS: dict[type, Any] = {
    Upload: UploadReport,
    Download: OnboardMission,
    UploadPlaces: UploadReport,
    DownloadPlaces: tuple[Item, ...],
    ReadParameters: dict[str, float | None],
    ListParameters: ParameterList,
    ReadMetadata: VehicleMetadata,
    WriteParameters: tuple[ParameterWritten, ...],
    ListVehicleLogs: tuple[VehicleLog, ...],
    ReadVehicleLog: bytes,
    HighestToken: int,
    MayFlyManoeuvre: str,
}
IssueAbove = Callable[[Operator, int], Operator | None]
"""The same operator with a token above this one, which no server has issued; None: it has, to somebody else."""


class LinkClient:
    def __init__(self, bus: Bus, issue_above: IssueAbove = lambda operator, highest: None) -> None:
        self._bus, self._issue_above = bus, issue_above
        self._liveness = Liveness(hung_s=HUNG_S, busy_s=HUNG_S, start_s=HUNG_S)

    @overload
    async def call(self, request: Upload | UploadPlaces) -> UploadReport: ...
    @overload
    async def call(self, request: Download) -> OnboardMission: ...
    @overload
    async def call(self, request: DownloadPlaces) -> tuple[Item, ...]: ...
    @overload
    async def call(self, request: ReadParameters) -> dict[str, float | None]: ...
    @overload
    async def call(self, request: ListParameters) -> ParameterList: ...
    @overload
    async def call(self, request: ReadMetadata) -> VehicleMetadata: ...
    @overload
    async def call(self, request: WriteParameters) -> tuple[ParameterWritten, ...]: ...
    @overload
    async def call(self, request: ListVehicleLogs) -> tuple[VehicleLog, ...]: ...
    @overload
    async def call(self, request: ReadVehicleLog) -> bytes: ...
    @overload
    async def call(self, request: MayFlyManoeuvre) -> str: ...
    @overload
    async def call(self, request: LinkRequest) -> Any: ...
    async def call(self, request: LinkRequest) -> Any:
        """Raises what the link raised; BusError when the node is not there or died over it.

        Who is in charge is not refused over a token that a stranger on the bus made up.
        """
        for _ in range(OVERTAKEN_TRIES):
            try:
                return await self._call(request)
            except OvertakenError:
                if isinstance(request, Looks):
                    raise
                operator = self._issue_above(request.operator, await self._call(HighestToken()))
                if operator is None:
                    raise
                request = replace(request, operator=operator)
        return await self._call(request)

    async def _call(self, request: LinkRequest) -> Any:
        answer, appears_s = _ANSWERS.get(type(request), type(None)), APPEARS_S
        if isinstance(request, Connect):
            appears_s = COMMAND_S
        asking = asyncio.ensure_future(
            self._bus.call(NAME, request, result=answer, timeout_s=_patience_s(request), appears_s=appears_s)
        )
        try:
            while not asking.done():
                await asyncio.wait((asking,), timeout=LOOK_EVERY_S)
                await self._check_alive(asking)
            return asking.result()
        finally:
            asking.cancel()

    async def _check_alive(self, asking: asyncio.Future[Any]) -> None:
        """A node that hangs answers nothing for as long as anybody waits."""
        facts = None if asking.done() else running_node(self._bus.runtime_dir, NAME)
        if facts is None or not self._liveness.look(facts, time.monotonic()).is_hung:
            return
        if await silence_counts(self._bus.runtime_dir):
            raise BusError(
                "The link does not answer. It is ended and started again.",
                advice=f"{TRANSMITTER} What was asked may still be done: look before you repeat.",
            )


def _patience_s(request: LinkRequest) -> float:
    if isinstance(request, Upload | UploadPlaces):
        return UPLOAD_S + UPLOAD_PER_ITEM_S * len(request.items)
    if isinstance(request, Download | DownloadPlaces):
        return DOWNLOAD_S
    if isinstance(request, ListParameters | ReadMetadata):
        return LIST_S
    if isinstance(request, ListVehicleLogs | ReadVehicleLog):
        return LOGS_S
    if isinstance(request, WriteParameters):
        return WRITE_S + WRITE_PER_CHANGE_S * len(request.changes)
    return START_S if isinstance(request, StartAuto | StartGuided | FlyWay) else COMMAND_S


async def log_stretches(link: LinkClient, operator: Operator, log: VehicleLog) -> AsyncIterator[bytes]:
    """The bytes of a vehicle's log in order: who no longer asks has ended it.

    Raises TransferError when it turns out shorter than the vehicle said.
    """
    for offset in range(0, log.size_bytes, MOST_BYTES):
        size = min(MOST_BYTES, log.size_bytes - offset)
        is_last = offset + size == log.size_bytes
        stretch = await link.call(ReadVehicleLog(operator, log.number, offset, size, is_last))
        yield stretch
        if len(stretch) < size:
            what = f"Log {log.number} ends after {offset + len(stretch)} of {log.size_bytes} bytes."
            raise TransferError(what, advice="What came is kept. Ask for the list again: the log may have changed.")
