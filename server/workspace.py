"""The open plan, shared by every page: edits, undo, files, and what follows from them.

All methods run on the event loop; heavy work goes to worker lanes. Every edit is on disk before it is
acknowledged, and every page hears of it.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import time
import zipfile
from collections.abc import Callable, Coroutine
from typing import Any, Protocol

import numpy as np

from planning.errors import PoiError
from planning.exports import FILES
from planning.poi import shortest_order
from planning.poi_files import looks_swapped, read_pois
from server import demo, tasks
from server.clock import utc_now
from server.computing import Computing
from server.documents import missing, with_points
from server.edits import clicked, moved
from server.errors import InUseError, NotReadyError, ServerError, StaleRevisionError, error_doc
from server.file_jobs import FileJobs
from server.history import History
from server.job_board import JobBoard, Spawn
from server.jobs import JobCancelledError, Lane
from server.library import Library
from server.picture import Picture, View
from server.schemas import (
    ClientMessage,
    ErrorDoc,
    FrameView,
    HoverProfile,
    HoverView,
    Imported,
    LibraryMessage,
    NoticeMessage,
    PlanDoc,
    PlanEdit,
    PlanMessage,
    PlanState,
    SelectionDoc,
    SelectionMessage,
    ServerMessage,
    SetSelection,
    SetView,
    Snapshot,
    TerrainDoc,
    ViewDoc,
    ViewMessage,
)


class Streams(Protocol):
    """The part of ``server.hub.Hub`` that the workspace uses."""

    def publish(self, message: ServerMessage) -> None: ...

    def send(self, page_id: str, message: ServerMessage) -> None: ...


class Workspace:
    """One open plan at a time: a ground station has one task in hand."""

    def __init__(self, library: Library, streams: Streams, view: View, *, spawn: Spawn) -> None:
        self._library, self._streams = library, streams
        self._plan_lane, self._file_lane = Lane("plan"), Lane("files")
        self._board = JobBoard(self._file_lane, publish=streams.publish, spawn=spawn)
        self._computing = Computing(self._plan_lane, terrain_dir=library.terrain_dir, changed=self._computed)
        self._picture = Picture(view, library, self._plan_lane, changed=self._legend, failed=self._tell)
        self.files = FileJobs(
            library,
            self._board,
            change=self._change,
            document=lambda: self.document,
            library_changed=self._publish_library,
            show_orthophoto=lambda: self._set_view(self.view.model_copy(update={"shading": "orthophoto"})),
        )
        self._editing = asyncio.Lock()
        self._plan_id, self._revision, self._saved_utc = "", 0, ""
        self._history = History()
        self.view, self.selection = ViewDoc(), SelectionDoc()

    # Life

    async def start(self) -> None:
        """Opens the plan that was open last, or a new one, and starts the loops."""
        last = await asyncio.to_thread(self._library.last_plan)
        if last is None:
            await self._adopt(*await asyncio.to_thread(self._library.create_plan, History()))
        else:
            await self._adopt(last, await asyncio.to_thread(self._library.load_plan, last))

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        """To be run by the application's task group until it ends."""
        return [self._computing.run(), self._picture.run(), self._warm_up()]

    async def close(self) -> None:
        await self._plan_lane.close()
        await self._file_lane.close()

    async def _warm_up(self) -> None:
        """Saves the first edit a wait; a failure here shows itself, and is told, when a plan is computed."""
        with contextlib.suppress(JobCancelledError, ServerError):
            await self._plan_lane.call(tasks.warm_up)

    # What pages see

    @property
    def document(self) -> PlanDoc:
        return self._history.present

    @property
    def state(self) -> PlanState:
        return PlanState(
            plan_id=self._plan_id,
            revision=self._revision,
            document=self.document,
            can_undo=bool(self._history.undo_label),
            can_redo=bool(self._history.redo_label),
            undo_label=self._history.undo_label,
            redo_label=self._history.redo_label,
            saved_utc=self._saved_utc,
            computation=self._computing.state,
        )

    def snapshot(self, page_id: str) -> Snapshot:
        return Snapshot(
            product_version=tasks.PRODUCT_VERSION,
            page_id=page_id,
            plan=self.state,
            library=self._library.state(),
            view=self.view,
            selection=self.selection,
            jobs=self._board.jobs,
        )

    # Edits

    async def edit(self, edit: PlanEdit) -> PlanState:
        """Raises StaleRevisionError when the plan has changed since ``base_revision``."""
        async with self._editing:
            if edit.base_revision != self._revision:
                raise StaleRevisionError(
                    f"The plan has changed meanwhile (revision {self._revision}, edit of {edit.base_revision}).",
                    advice="Look at the present plan and make the change again.",
                )
            await self._commit(edit.label, edit.document, coalesce=edit.coalesce)
        return self.state

    async def undo(self) -> PlanState:
        return await self._travel(History.undo)

    async def redo(self) -> PlanState:
        return await self._travel(History.redo)

    async def _travel(self, step: Callable[[History], bool]) -> PlanState:
        async with self._editing:
            if step(self._history):
                await self._persist()
        return self.state

    async def _change(self, label: str, change: Callable[[PlanDoc], PlanDoc]) -> PlanState:
        """An edit that the server makes itself, on whatever is present when its turn comes."""
        async with self._editing:
            await self._commit(label, change(self.document))
        return self.state

    async def _commit(self, label: str, document: PlanDoc, *, coalesce: bool = False) -> None:
        if document == self.document:
            return
        self._check_references(document)
        self._history.edit(label, document, coalesce=coalesce, now_mono_s=time.monotonic())
        await self._persist()

    def _check_references(self, document: PlanDoc) -> None:
        if document.terrain_id is not None:
            self._library.terrain_dir(document.terrain_id)
        if document.orthophoto_id is not None:
            self._library.orthophoto_dir(document.orthophoto_id)

    async def _persist(self) -> None:
        """On disk first, then in sight: what is acknowledged is never lost."""
        try:
            self._saved_utc = await asyncio.to_thread(self._library.save_plan, self._plan_id, self._history)
        except ServerError as error:
            self._tell(error)
        self._revision += 1
        self._computing.request(self._revision, self.document)
        self._show()
        self._streams.publish(PlanMessage(plan=self.state))

    # Plans

    async def new(self) -> PlanState:
        keep = PlanDoc(terrain_id=self.document.terrain_id, profile=self.document.profile)
        return await self._adopt(*await asyncio.to_thread(self._library.create_plan, History([keep])))

    async def open(self, plan_id: str) -> PlanState:
        return await self._adopt(plan_id, await asyncio.to_thread(self._library.load_plan, plan_id))

    async def save_as(self, name: str) -> PlanState:
        copy = History([self.document.model_copy(update={"name": name})])
        return await self._adopt(*await asyncio.to_thread(self._library.create_plan, copy))

    async def delete(self, plan_id: str) -> None:
        if plan_id == self._plan_id:
            raise InUseError("This plan is open.", where=self.document.name, advice="Open another plan first.")
        await asyncio.to_thread(self._library.delete_plan, plan_id)
        self._publish_library()

    async def _adopt(self, plan_id: str, history: History) -> PlanState:
        async with self._editing:
            self._plan_id, self._history = plan_id, history
            await asyncio.to_thread(self._library.remember_plan, plan_id)
            self._saved_utc = self._library.saved_utc(plan_id)
            self._revision += 1
            self.selection = SelectionDoc()
            self._computing.request(self._revision, self.document, forget=True)
            self._show()
            self._streams.publish(SelectionMessage(selection=self.selection))
            self._streams.publish(PlanMessage(plan=self.state))
            self._publish_library()
        return self.state

    # Points

    async def import_points(self, filename: str, data: bytes) -> Imported:
        """Replaces the points, or the polygon, by those of a file. Raises FormatError, PoiError."""
        points = await asyncio.to_thread(read_pois, filename, data)
        warnings = list(points.warnings)
        dsm = self._picture.dsm
        if dsm is not None and looks_swapped(points.pois, dsm):
            warnings.append("Latitude and longitude seem swapped: exchanged, these points lie on the surface model.")
        state = await self._change(f"Import {filename[:40]}", lambda document: with_points(document, points))
        return Imported(state=state, warnings=warnings)

    async def shortest_order(self) -> PlanState:
        """Reorders the points to the shortest route that keeps the first one."""
        dsm = self._picture.dsm
        if dsm is None or len(self.document.pois) < 3:
            raise PoiError(
                "There is nothing to reorder.", advice="Choose a surface model and add three points or more."
            )

        def reorder(document: PlanDoc) -> PlanDoc:
            xy_m = dsm.xy_from_lat_lon(np.array([(p.lat_deg, p.lon_deg) for p in document.pois]))
            return document.model_copy(update={"pois": [document.pois[i] for i in shortest_order(xy_m)]})

        return await self._change("Shortest order", reorder)

    async def on_terrain_click(self, lat_deg: float, lon_deg: float, *, known: bool) -> None:
        """A click in the 3D view, through the tool in hand."""
        async with self._editing:
            outcome = clicked(self.document, self.selection, lat_deg, lon_deg)
            if outcome is None:
                return
            if not known:
                error = ErrorDoc(
                    code="poi",
                    what="The surface is unknown there.",
                    where=f"{lat_deg:.7f}, {lon_deg:.7f}",
                    advice="Choose a place on known ground.",
                )
                self._streams.publish(NoticeMessage(level="warning", error=error))
                return
            label, document, selection = outcome
            await self._commit(label, document)
        self._select(selection)

    async def on_poi_moved(self, poi_id: str, lat_deg: float, lon_deg: float) -> None:
        async with self._editing:
            outcome = moved(self.document, poi_id, lat_deg, lon_deg)
            if outcome is not None:
                await self._commit(*outcome)

    async def on_poi_click(self, poi_id: str) -> None:
        self._select(self.selection.model_copy(update={"poi_id": poi_id}))

    # Files

    async def export(self, file: str) -> bytes:
        """One export file, or ``all.zip``; computed from the present document. Raises NotReadyError."""
        document = self.document
        hint = missing(document)
        if hint:
            raise NotReadyError("There is no plan to export yet.", advice=hint)
        directory = self._library.terrain_dir(document.terrain_id or "")
        names = list(FILES) if file == "all.zip" else [file]
        files = await self._plan_lane.call(tasks.export_plan, directory, document, names, utc_now())
        return _zipped(files) if file == "all.zip" else files[file]

    async def add_demo_terrain(self) -> TerrainDoc:
        """The generated demo model with its plan, made on first use, opened."""
        terrain, plan_id = await demo.ensure(self._library, self._file_lane)
        await self.open(plan_id)
        return terrain

    async def delete_terrain(self, terrain_id: str) -> None:
        users = await asyncio.to_thread(self._library.plans_using, terrain_id)
        if self.document.terrain_id == terrain_id:
            users = [self.document.name, *users]
        if users:
            raise InUseError(
                f"The surface model is used by {users[0]}.", advice="Delete that plan or give it another model first."
            )
        await asyncio.to_thread(self._library.delete_terrain, terrain_id)
        self._publish_library()

    async def cancel_job(self, job_id: str) -> None:
        self._board.cancel(job_id)

    # Messages of pages

    async def on_client_message(self, page_id: str, message: ClientMessage) -> None:
        match message:
            case HoverProfile():
                self._streams.publish(await self._picture.mark(self._computing.scene, message.s_m))
            case HoverView():
                place = None if message.x is None or message.y is None else (message.x, message.y)
                self._streams.publish(await self._picture.mark_under(self._computing.scene, page_id, place))
            case SetView():
                self._set_view(message.view)
            case SetSelection():
                self._select(message.selection)
            case FrameView():
                await self._picture.frame(message, page_id)

    def _set_view(self, view: ViewDoc) -> None:
        low_m, high_m = self._picture.legend_m or (None, None)
        self.view = view.model_copy(update={"legend_min_m": low_m, "legend_max_m": high_m})
        self._streams.publish(ViewMessage(view=self.view))
        self._show()

    def _select(self, selection: SelectionDoc) -> None:
        self.selection = selection
        self._streams.publish(SelectionMessage(selection=selection))
        self._show()

    # What follows

    def _computed(self) -> None:
        self._show()
        self._streams.publish(PlanMessage(plan=self.state))

    def _legend(self) -> None:
        low_m, high_m = self._picture.legend_m or (None, None)
        self.view = self.view.model_copy(update={"legend_min_m": low_m, "legend_max_m": high_m})
        self._streams.publish(ViewMessage(view=self.view))

    def _tell(self, error: Exception) -> None:
        self._streams.publish(NoticeMessage(level="error", error=error_doc(error)))

    def _show(self) -> None:
        stale = self._computing.state.state == "running"
        self._picture.want(self.document, self.selection, self.view, self._computing.scene, stale=stale)

    def _publish_library(self) -> None:
        self._streams.publish(LibraryMessage(library=self._library.state()))


def _zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()
