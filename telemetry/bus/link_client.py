"""Asks the link node over the bus: every request of ``telemetry.topics.requests``, its answer with its type."""

from __future__ import annotations

from typing import Any, overload

from telemetry.bus import Bus
from telemetry.topics.messages import OnboardMission, UploadReport
from telemetry.topics.requests import Download, LinkRequest, ReadParameters, StartAuto, StartGuided, Upload

NAME = "link"
COMMAND_S = 30.0
"""A command is given up by the link itself after about half of this."""
START_S = 90.0
"""Modes, arming and take-off, one after the other."""
DOWNLOAD_S = 180.0
UPLOAD_S, UPLOAD_PER_ITEM_S = 240.0, 5.0
_ANSWERS: dict[type, Any] = {
    Upload: UploadReport,
    Download: OnboardMission,
    ReadParameters: dict[str, float | None],
}


class LinkClient:
    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    @overload
    async def call(self, request: Upload) -> UploadReport: ...
    @overload
    async def call(self, request: Download) -> OnboardMission: ...
    @overload
    async def call(self, request: ReadParameters) -> dict[str, float | None]: ...
    @overload
    async def call(self, request: LinkRequest) -> Any: ...
    async def call(self, request: LinkRequest) -> Any:
        """Raises what the link raised; BusError when the node is not there or died over it."""
        answer = _ANSWERS.get(type(request), type(None))
        return await self._bus.call(NAME, request, result=answer, timeout_s=_patience_s(request))


def _patience_s(request: LinkRequest) -> float:
    if isinstance(request, Upload):
        return UPLOAD_S + UPLOAD_PER_ITEM_S * len(request.items)
    if isinstance(request, Download):
        return DOWNLOAD_S
    return START_S if isinstance(request, StartAuto | StartGuided) else COMMAND_S
