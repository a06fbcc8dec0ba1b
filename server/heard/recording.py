"""Recordings as the pages see them: started, stopped, brought in, deleted, listed anew whenever something changes."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

from server.errors import InUseError
from server.heard import recording_task
from server.library.recording_list import RecordingShelf
from server.schemas import RecorderMessage, RecordingDoc, RecordingsMessage, ServerMessage
from server.work.jobs import Lane, Progress
from telemetry.topics.messages import RecorderStatus
from telemetry.topics.requests import RecorderRequest, StartRecording, StopRecording

T = TypeVar("T")
Ask = Callable[[RecorderRequest], Awaitable[object]]
Run = Callable[[str, Callable[[Lane, Progress], Awaitable[object]]], Awaitable[object]]
"""``JobBoard.run``: a job that pages see, on the file lane."""


class RecordingDesk:
    """``ask`` reaches the recorder node, which is started for it; ``in_review()`` names the file that is open."""

    def __init__(
        self,
        shelf: RecordingShelf,
        *,
        ask: Ask,
        run: Run,
        tell: Callable[[ServerMessage], None],
        in_review: Callable[[], str | None],
    ) -> None:
        self._shelf, self._ask, self._run, self._tell, self._in_review = shelf, ask, run, tell, in_review
        self._listing = asyncio.Lock()
        self._look_again = False
        self.status: RecorderStatus | None = None

    async def on_status(self, status: RecorderStatus) -> None:
        before, self.status = self.status, status
        self._tell(RecorderMessage(recorder=status))
        changed = before is None or (before.recording, before.name) != (status.recording, status.name)
        if changed or self._look_again:
            # A file that has just been ended gets its last part a moment later.
            self._look_again = changed
            await self.refresh()

    async def start(self) -> None:
        await self._ask(StartRecording())

    async def stop(self) -> None:
        await self._ask(StopRecording())

    async def docs(self) -> list[RecordingDoc]:
        async with self._listing:
            return await asyncio.to_thread(self._shelf.docs, being_written=self.being_written)

    async def refresh(self) -> None:
        self._tell(RecordingsMessage(recordings=await self.docs()))

    async def add(self, upload: Path, name: str) -> RecordingDoc:
        """Takes in an uploaded file. Raises RecordingError when it holds no flight."""
        try:
            await self._run(f"Reading {name}", lambda lane, progress: lane.call(recording_task.read, upload, name))
            doc = await asyncio.to_thread(self._shelf.add, upload, name)
        finally:
            await asyncio.to_thread(upload.unlink, missing_ok=True)
        await self.refresh()
        return doc

    async def delete(self, recording_id: str) -> None:
        """Raises NotFoundError, InUseError."""
        name = (await asyncio.to_thread(self._shelf.path, recording_id)).name
        if name == self.being_written:
            raise InUseError("This recording is being written.", where=name, advice="Stop it first.")
        if name == self._in_review():
            raise InUseError("This recording is open.", where=name, advice="Close the review first.")
        await asyncio.to_thread(self._shelf.delete, recording_id)
        await self.refresh()

    @property
    def being_written(self) -> str | None:
        return self.status.name if self.status is not None and self.status.recording else None
