"""Files of raw radar samples, as pages look at them: kept, opened, and processed frame by frame in a worker."""

from __future__ import annotations

import asyncio
from pathlib import Path

from server.library.radar_files import RadarShelf
from server.schemas import Pages, RadarFileDoc, RadarFilesMessage, RadarFrame, RadarOpened, RadarReading
from server.studies import radar_task
from server.studies.latest import Latest
from server.studies.radar_task import Stored
from server.work.jobs import Lane


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
        samples, cfg = self._shelf.paths(file_id)
        return Stored(self._shelf.get(file_id).doc, samples, cfg)
