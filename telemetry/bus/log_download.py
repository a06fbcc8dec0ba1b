"""A whole log of the vehicle, stretch by stretch over the link: who no longer asks has ended it."""

from __future__ import annotations

from collections.abc import AsyncIterator

from telemetry.bus.link_client import LinkClient
from telemetry.errors import TransferError
from telemetry.topics.requests import Operator, ReadVehicleLog
from telemetry.topics.vehicle_logs import MOST_BYTES, VehicleLog


async def log_stretches(link: LinkClient, operator: Operator, log: VehicleLog) -> AsyncIterator[bytes]:
    """The log's bytes in order. Raises TransferError when it turns out shorter than the vehicle said."""
    for offset in range(0, log.size_bytes, MOST_BYTES):
        size = min(MOST_BYTES, log.size_bytes - offset)
        is_last = offset + size == log.size_bytes
        stretch = await link.call(ReadVehicleLog(operator, log.number, offset, size, is_last))
        yield stretch
        if len(stretch) < size:
            what = f"Log {log.number} ends after {offset + len(stretch)} of {log.size_bytes} bytes."
            raise TransferError(what, advice="What came is kept. Ask for the list again: the log may have changed.")
