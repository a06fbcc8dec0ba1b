"""Jobs on files: reading surface models and orthomosaics, removing spikes; what they make joins the library."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

from server import file_tasks
from server.job_board import JobBoard
from server.jobs import Lane, Progress
from server.library import Library
from server.schemas import JobDoc, PlanDoc, PlanState, TerrainDoc

T = TypeVar("T")
Change = Callable[[str, Callable[[PlanDoc], PlanDoc]], Awaitable[PlanState]]


class FileJobs:
    """Starts jobs on the board and lets the open plan use what they make."""

    def __init__(
        self,
        library: Library,
        board: JobBoard,
        *,
        change: Change,
        document: Callable[[], PlanDoc],
        library_changed: Callable[[], None],
        show_orthophoto: Callable[[], None],
    ) -> None:
        self._library, self._board = library, board
        self._change, self._document = change, document
        self._library_changed, self._show_orthophoto = library_changed, show_orthophoto

    def add_terrain(
        self,
        upload: Path,
        filename: str,
        *,
        crs: str | None,
        z_scale: float | None,
        vertical_datum: str | None,
        remove_spikes: bool,
    ) -> JobDoc:
        """Reads an uploaded surface model; the open plan takes it unless it has points on another one."""

        async def work(lane: Lane, progress: Progress) -> None:
            terrain: TerrainDoc = await self._consume(
                upload,
                lane.call(
                    file_tasks.import_terrain,
                    self._library.root,
                    upload,
                    filename,
                    crs=crs,
                    z_scale=z_scale,
                    vertical_datum=vertical_datum,
                    remove_spikes=remove_spikes,
                    progress=progress,
                ),
            )
            if self._document().terrain_id is None or not self._document().pois:
                await self._change(f"Use {terrain.name[:40]}", lambda document: _on_terrain(document, terrain.id))

        return self._board.start(f"Reading {filename}", work)

    def add_orthophoto(self, upload: Path, filename: str, terrain_id: str) -> JobDoc:
        """Reads an uploaded orthomosaic and drapes it on its surface model."""
        terrain_dir = self._library.terrain_dir(terrain_id)

        async def work(lane: Lane, progress: Progress) -> None:
            photo = await self._consume(
                upload,
                lane.call(
                    file_tasks.import_orthophoto,
                    self._library.root,
                    terrain_dir,
                    upload,
                    filename,
                    terrain_id=terrain_id,
                    progress=progress,
                ),
            )
            self._show_orthophoto()
            await self._change(
                "Drape orthomosaic", lambda document: document.model_copy(update={"orthophoto_id": photo.id})
            )

        return self._board.start(f"Reading {filename}", work)

    def remove_spikes(self, terrain_id: str) -> JobDoc:
        """Makes a copy of a surface model without its isolated spikes and pits, and uses it."""
        terrain_dir = self._library.terrain_dir(terrain_id)

        async def work(lane: Lane, progress: Progress) -> None:
            terrain = await lane.call(file_tasks.without_spikes, self._library.root, terrain_dir, progress=progress)
            await asyncio.to_thread(self._library.refresh)
            self._library_changed()
            await self._change("Remove spikes", lambda document: _on_terrain(document, terrain.id))

        return self._board.start("Removing spikes", work)

    async def _consume(self, upload: Path, reading: Awaitable[T]) -> T:
        """Awaits the reading of an uploaded file, which is deleted whatever comes of it."""
        try:
            made = await reading
        finally:
            await asyncio.to_thread(upload.unlink, missing_ok=True)
        await asyncio.to_thread(self._library.refresh)
        self._library_changed()
        return made


def _on_terrain(document: PlanDoc, terrain_id: str) -> PlanDoc:
    return document.model_copy(update={"terrain_id": terrain_id, "orthophoto_id": None})
