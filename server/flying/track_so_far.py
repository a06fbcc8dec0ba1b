"""A server that starts in the middle of a flight gets the path flown so far from the recording that goes on."""

from __future__ import annotations

import logging
from pathlib import Path

from server.errors import reported
from server.heard.channel import Channel
from server.heard.recording_task import states_so_far
from server.work.jobs import Lane
from telemetry.topics.messages import RecorderStatus
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.flying")


class TrackSoFar:
    """Looks once: at the first word of the recorder."""

    def __init__(self, folder: Path, channel: Channel, lane: Lane) -> None:
        self._folder, self._channel, self._lane = folder, channel, lane
        self._looked = False

    async def on_status(self, status: RecorderStatus) -> None:
        if self._looked:
            return
        self._looked = True
        if status.recording and status.name is not None:
            try:
                states: list[VehicleState] = await self._lane.call(states_so_far, self._folder / status.name)
            except Exception as error:
                log.warning("The path flown so far: %s", reported(error, log, "Reading the recording").what)
                return
            self._channel.prepend(states)
