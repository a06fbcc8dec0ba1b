"""Jobs on files: reading surface models and orthomosaics, removing spikes; what they make joins the library."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from pathlib import Path
from typing import TypeVar

from server.errors import NotFoundError
from server.library import Library
from server.library.terrains import UNKNOWN_ORIGIN, Origin
from server.plan import file_tasks
from server.plan.archives import remove_upload
from server.plan.on_show import OnShow
from server.plan.plan_desk import PlanDesk
from server.schemas import ErrorDoc, JobDoc, MeshDoc, NoticeMessage, OrthophotoDoc, Pages, PlanDoc, TerrainDoc
from server.work.job_board import JobBoard
from server.work.jobs import Lane, Progress

T = TypeVar("T")


class FileJobs:
    """Starts jobs on the board and lets the open plan use what they make."""

    def __init__(self, library: Library, board: JobBoard, desk: PlanDesk, on_show: OnShow, pages: Pages) -> None:
        self._library, self._board, self._desk, self._on_show, self._pages = library, board, desk, on_show, pages

    def add_terrain(
        self,
        upload: Path,
        filename: str,
        *,
        origin: Origin = UNKNOWN_ORIGIN,
        crs: str | None,
        z_scale: float | None,
        vertical_datum: str | None,
        remove_spikes: bool,
        cell_m: float | None = None,
        keep_noise: bool = False,
    ) -> JobDoc:
        """Reads an uploaded model or point cloud; the open plan takes it unless it has points on another one."""

        under_id = self._on_show.terrain_id
        under = None if under_id is None else (under_id, self._library.terrain_dir(under_id))

        async def work(lane: Lane, progress: Progress) -> None:
            terrain: TerrainDoc | MeshDoc = await self._made(
                lane.call(
                    file_tasks.import_terrain,
                    self._library.root,
                    upload,
                    filename,
                    origin=origin,
                    crs=crs,
                    z_scale=z_scale,
                    vertical_datum=vertical_datum,
                    remove_spikes=remove_spikes,
                    cell_m=cell_m,
                    keep_noise=keep_noise,
                    under=under,
                    progress=progress,
                ),
            )
            if isinstance(terrain, MeshDoc):
                await self._lay(terrain)
                return
            photos = [photo.id for photo in self._library.orthophotos() if photo.terrain_id == terrain.id]
            if terrain.in_doubt:
                self._pages.publish(_not_taken(terrain))
            await self._desk.propose(lambda document: use_if_free(document, terrain, next(iter(photos), None)))

        return self._board.start(f"Reading {filename}", work, clean=lambda: remove_upload(upload))

    def add_orthophoto(self, upload: Path, filename: str, terrain_id: str) -> JobDoc:
        """Reads an uploaded orthomosaic and drapes it on its surface model."""
        terrain_dir = self._library.terrain_dir(terrain_id)

        async def work(lane: Lane, progress: Progress) -> None:
            self._library.terrain_dir(terrain_id)
            photo: OrthophotoDoc = await self._made(
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
            await self._drape(photo)

        return self._board.start(f"Reading {filename}", work, clean=lambda: upload.unlink(missing_ok=True))

    def remove_spikes(self, terrain_id: str) -> JobDoc:
        """Makes a copy of a surface model without its isolated spikes and pits, and uses it."""
        terrain_dir = self._library.terrain_dir(terrain_id)

        async def work(lane: Lane, progress: Progress) -> None:
            self._library.terrain_dir(terrain_id)
            terrain: TerrainDoc = await self._made(
                lane.call(file_tasks.without_spikes, self._library.root, terrain_dir, progress=progress)
            )
            await self._desk.propose(lambda document: _swap(document, terrain_id, terrain))

        return self._board.start("Removing spikes", work)

    async def delete_mesh(self, mesh_id: str) -> None:
        """The model that gave way to it is drawn again. Raises NotFoundError."""
        self._library.mesh_dir(mesh_id)
        shown = self._library.mesh_of(self._on_show.terrain_id)
        await asyncio.to_thread(self._library.delete_mesh, mesh_id)
        self._pages.publish(self._library.message())
        if shown is not None and shown.id == mesh_id:
            self._on_show.hide_textured()

    async def _lay(self, mesh: MeshDoc) -> None:
        """On show at once where its model is; those that the model had before are gone."""
        try:
            self._library.terrain_dir(mesh.terrain_id)
        except NotFoundError:
            # Its surface model was deleted while it was read.
            await self.delete_mesh(mesh.id)
            raise
        for doc in self._library.meshes():
            if doc.terrain_id == mesh.terrain_id and doc.id != mesh.id:
                await asyncio.to_thread(self._library.delete_mesh, doc.id)
        self._pages.publish(self._library.message())
        if self._on_show.terrain_id == mesh.terrain_id:
            self._on_show.show_textured()

    async def _drape(self, photo: OrthophotoDoc) -> None:
        try:
            self._library.terrain_dir(photo.terrain_id)
        except NotFoundError:
            # Its surface model was deleted while it was read.
            await asyncio.to_thread(self._library.delete_orthophoto, photo.id)
            self._pages.publish(self._library.message())
            raise

        def drape(document: PlanDoc) -> tuple[str, PlanDoc] | None:
            if document.terrain_id != photo.terrain_id:
                return None
            self._on_show.show_orthophoto()
            return "Drape orthomosaic", document.model_copy(update={"orthophoto_id": photo.id})

        await self._desk.propose(drape)

    async def _made(self, making: Awaitable[T]) -> T:
        """Takes what a worker stores into the library; a worker that was killed while storing leaves nothing half.

        What it had stored whole by then, a model whose orthophoto was to follow, is in the library as well.
        """
        try:
            made = await making
        except Exception:
            await asyncio.to_thread(self._library.clear_unfinished)
            await self._take_in()
            raise
        await self._take_in()
        return made

    async def _take_in(self) -> None:
        await asyncio.to_thread(self._library.refresh)
        self._pages.publish(self._library.message())


def _not_taken(terrain: TerrainDoc) -> NoticeMessage:
    what = "Parts of the point cloud stand above this surface model, so no plan took it by itself."
    advice = "Read what is said of it in Plan before you use it."
    return NoticeMessage(level="warning", error=ErrorDoc(code="in_doubt", what=what, where=terrain.name, advice=advice))


def use_if_free(document: PlanDoc, terrain: TerrainDoc, photo_id: str | None) -> tuple[str, PlanDoc] | None:
    """Not one in doubt. With the orthophoto that came with it, which is there to be chosen and not yet draped."""
    if terrain.in_doubt or (document.terrain_id is not None and (document.pois or document.survey.polygon)):
        return None
    taken = on_terrain(document, terrain.id).model_copy(update={"orthophoto_id": photo_id})
    return f"Use {terrain.name[:40]}", taken


def _swap(document: PlanDoc, terrain_id: str, terrain: TerrainDoc) -> tuple[str, PlanDoc] | None:
    return ("Remove spikes", on_terrain(document, terrain.id)) if document.terrain_id == terrain_id else None


def on_terrain(document: PlanDoc, terrain_id: str) -> PlanDoc:
    return document.model_copy(update={"terrain_id": terrain_id, "orthophoto_id": None})
