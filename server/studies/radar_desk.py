"""Files of raw radar samples, as pages look at them: kept, opened, and processed frame by frame in a worker."""

from __future__ import annotations

import asyncio
from pathlib import Path

from server.errors import BadRequestError
from server.library.radar_files import RadarShelf
from server.schemas import (
    JobDoc,
    Pages,
    RadarFileDoc,
    RadarFilesMessage,
    RadarFrame,
    RadarOpened,
    RadarReading,
    RadarTracksBody,
    RadarTracksDoc,
)
from server.studies import radar_task
from server.studies.latest import Latest
from server.studies.radar_task import Stored
from server.work.job_board import JobBoard
from server.work.jobs import Lane, Progress


class RadarDesk:
    """All methods belong to the event loop."""

    def __init__(self, shelf: RadarShelf, pages: Pages) -> None:
        self._shelf, self._pages = shelf, pages
        self._lane = Lane("radar")
        self._latest = Latest(self._lane)

    async def close(self) -> None:
        await self._lane.close()

    def message(self) -> RadarFilesMessage:
        return RadarFilesMessage(files=self._shelf.docs())

    async def add(self, upload: Path, name: str) -> RadarFileDoc:
        """Keeps an uploaded file. Raises BadRequestError, StorageError; then the upload is gone."""
        try:
            doc = await asyncio.to_thread(self._shelf.add, upload, name)
        finally:
            await asyncio.to_thread(upload.unlink, missing_ok=True)
        self._pages.publish(self.message())
        return doc

    async def set_cfg(self, file_id: str, data: bytes | None, name: str = "") -> RadarFileDoc:
        """The configuration that the radar ran with; None takes it away. Raises NotFoundError."""
        doc = await asyncio.to_thread(self._shelf.set_cfg, file_id, data, name)
        self._pages.publish(self.message())
        return doc

    async def set_capture(self, file_id: str, upload: Path | None, name: str = "") -> RadarFileDoc:
        """What motion capture saw of the same flight; None takes it away.

        Raises NotFoundError, BadRequestError for samples that come with no capture, StorageError.
        """
        try:
            if upload is not None:
                _check_rows(self._stored(file_id).doc.name)
            doc = await asyncio.to_thread(self._shelf.set_capture, file_id, upload, name)
        finally:
            if upload is not None:
                await asyncio.to_thread(upload.unlink, missing_ok=True)
        self._pages.publish(self.message())
        return doc

    def follow(self, file_id: str, asked: RadarTracksBody, board: JobBoard) -> JobDoc:
        """A job that holds the radar's tracks against the capture, and keeps what comes out.

        Raises NotFoundError, BadRequestError without a capture, BusyError.
        """
        stored = self._stored(file_id)
        name, capture = stored.doc.name, stored.paths.capture
        if capture is None:
            what = f"There is no motion capture to hold {name} against."
            raise BadRequestError(what, where=name, advice="Give the optitrack.csv that was recorded beside it.")

        async def work(lane: Lane, progress: Progress) -> None:
            found = await lane.call(radar_task.follow_poles, stored, asked, progress=progress)
            await asyncio.to_thread(self._shelf.set_tracks, file_id, found, capture)
            self._pages.publish(self.message())

        return board.start(f"Following the poles of {name}", work)

    async def tracks(self, file_id: str) -> RadarTracksDoc:
        """Raises NotFoundError, StorageError."""
        return await asyncio.to_thread(self._shelf.tracks, file_id)

    async def delete(self, file_id: str) -> None:
        """Raises NotFoundError."""
        await asyncio.to_thread(self._shelf.delete, file_id)
        self._pages.publish(self.message())

    async def open(self, page: str, file_id: str, how: RadarReading) -> RadarOpened:
        """Raises NotFoundError, RadarDataError; JobCancelledError when the page asks for something else meanwhile."""
        return await self._latest.call(page, radar_task.open_file, self._stored(file_id), how)

    async def frame(self, page: str, file_id: str, how: RadarReading, number: int) -> RadarFrame:
        """As ``open``; also BadRequestError for a frame that is not there."""
        return await self._latest.call(page, radar_task.process_frame, self._stored(file_id), how, number)

    def _stored(self, file_id: str) -> Stored:
        return Stored(self._shelf.get(file_id).doc, self._shelf.paths(file_id))


def _check_rows(name: str) -> None:
    """Raises BadRequestError."""
    if not name.lower().endswith(".csv"):
        what = f"{name} holds no rows of samples as the ODA data set has them."
        raise BadRequestError(what, where=name, advice="A capture goes with its radar.csv: open that first.")
