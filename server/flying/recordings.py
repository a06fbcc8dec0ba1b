"""Recordings as the pages see them: started, stopped, brought in, deleted, listed anew whenever something changes.

A server that starts in the middle of a flight gets the path flown so far from the recording that goes on.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from pathlib import Path

from server.errors import InUseError, reported
from server.flying import review_task
from server.flying.reviewing import Reviewing
from server.heard.channel import Channel
from server.heard.node_states import Nodes
from server.library.recording_list import RecordingShelf
from server.schemas import Pages, RecorderMessage, RecordingDoc, RecordingsMessage
from server.work.job_board import JobBoard
from server.work.jobs import Lane
from telemetry.topics.messages import RecorderStatus
from telemetry.topics.recording_requests import StartRecording, StopRecording
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.flying")


class RecordingDesk:
    """Of all vehicles."""

    def __init__(self, shelf: RecordingShelf, board: JobBoard, reviewing: Reviewing, pages: Pages) -> None:
        self._shelf, self._board, self._reviewing, self._pages = shelf, board, reviewing, pages
        self._listing = asyncio.Lock()

    async def run(self) -> None:
        """Lists anew whenever a recorder has begun or ended one; until cancelled. What cannot be read ends nothing."""
        while True:
            try:
                await self.refresh()
            except Exception as error:
                log.warning("Listing the recordings: %s", reported(error, log, "Listing the recordings").what)
            await self._shelf.changed.wait()
            self._shelf.changed.clear()

    @property
    def root(self) -> Path:
        """The data directory."""
        return self._shelf.root

    async def shelved(self) -> list[tuple[Path, RecordingDoc]]:
        """Each with its file. Raises StorageError."""
        async with self._listing:
            return await asyncio.to_thread(self._shelf.shelved)

    async def docs(self) -> list[RecordingDoc]:
        async with self._listing:
            return await asyncio.to_thread(self._shelf.docs)

    async def refresh(self) -> None:
        self._pages.publish(RecordingsMessage(recordings=await self.docs()))

    async def add(self, upload: Path, name: str) -> RecordingDoc:
        """Takes in an uploaded file. Raises RecordingError when it holds no flight."""
        try:
            await self._board.run(f"Reading {name}", lambda lane, _: lane.call(review_task.read, upload, name))
            doc = await asyncio.to_thread(self._shelf.add, upload, name)
        finally:
            await asyncio.to_thread(upload.unlink, missing_ok=True)
        await self.refresh()
        return doc

    async def add_fetched(self, path: str, name: str, station: str, sha256: str) -> RecordingDoc:
        """Takes in what came from another station, where it can be read. Raises RecordingError when it holds no flight;
        the file is left then."""
        await self._board.run(f"Reading {name}", lambda lane, _: lane.call(review_task.read, Path(path), name))
        doc = await asyncio.to_thread(self._shelf.add, Path(path), name, station, sha256)
        await self.refresh()
        return doc

    async def delete(self, recording_id: str) -> None:
        """Raises NotFoundError, InUseError."""
        path = await asyncio.to_thread(self._shelf.path, recording_id)
        if path in self._shelf.being_written.values():
            raise InUseError("This recording is being written.", where=path.name, advice="Stop it first.")
        if path == self._reviewing.path:
            raise InUseError("This recording is open.", where=path.name, advice="Close the review first.")
        await asyncio.to_thread(self._shelf.delete, recording_id)
        await self.refresh()


class Recording:
    """What one vehicle's recorder does."""

    def __init__(self, vehicle: int, folder: Path, shelf: RecordingShelf, nodes: Nodes, pages: Pages) -> None:
        self._vehicle, self._folder, self._shelf, self._nodes, self._pages = vehicle, folder, shelf, nodes, pages
        self._look_again, self._started_mono_s = False, -math.inf
        self.status: RecorderStatus | None = None

    def on_status(self, status: RecorderStatus) -> None:
        before, self.status = self.status, status
        self._pages.publish(RecorderMessage(recorder=status))
        changed = before is None or (before.recording, before.name) != (status.recording, status.name)
        # One from before the recorder began does not know yet which file it writes.
        if status.recording or status.t_mono_s > self._started_mono_s:
            changed |= self._is_written(self._folder / status.name if status.recording and status.name else None)
        if changed or self._look_again:
            # A file that has just been ended gets its last part a moment later.
            self._look_again = changed
            self._shelf.changed.set()

    def _is_written(self, path: Path | None) -> bool:
        """Whether that is new."""
        written = self._shelf.being_written
        before = written.get(self._vehicle)
        if path is not None:
            written[self._vehicle] = path
        elif before is not None:
            del written[self._vehicle]
        return path != before

    async def start(self) -> None:
        name = await self._nodes.ask_recorder(StartRecording())
        # Its file is there before its status is: it is neither listed nor deleted meanwhile.
        self._started_mono_s = time.monotonic()
        self._shelf.being_written[self._vehicle] = self._folder / str(name)
        self._shelf.changed.set()

    async def stop(self) -> None:
        await self._nodes.ask_recorder(StopRecording())


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
                states: list[VehicleState] = await self._lane.call(
                    review_task.states_so_far, self._folder / status.name
                )
            except Exception as error:
                log.warning("The path flown so far: %s", reported(error, log, "Reading the recording").what)
                return
            self._channel.prepend(states)
