"""What all pages work on together: the open plan, its answer, its picture, and the jobs that bring files in.

All methods run on the event loop; heavy work goes to worker lanes. Every page hears of every change.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, Protocol

from planning.dsm import Dsm
from planning.poi_files import looks_swapped, read_pois
from server import demo, file_tasks, ordering, tasks
from server.computing import Computing
from server.documents import with_points
from server.errors import InUseError, NotFoundError, NotReadyError, reported
from server.exporting import exported
from server.file_jobs import FileJobs
from server.job_board import JobBoard, Spawn
from server.jobs import Lane
from server.library import Library
from server.obstacles.mirror import Voxels
from server.obstacles.seen_task import keep_seen
from server.picture import Picture, View
from server.plan_desk import PlanDesk
from server.pointing import Pointing
from server.scene.payload import PlanScene, ReviewScene
from server.scene.sights import Sights
from server.scene.vehicles import Vehicles
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

log = logging.getLogger("hedgehop.plan")

_FILES_NICENESS = 10
"""Reading files leaves the processor to the answer that an operator waits for."""


class Streams(Protocol):
    """The part of ``server.hub.Hub`` that the workspace uses."""

    def publish(self, message: ServerMessage) -> None: ...

    def send(self, page_id: str, message: ServerMessage) -> None: ...


class Workspace:
    """One open plan at a time: a ground station has one task in hand."""

    def __init__(
        self,
        library: Library,
        streams: Streams,
        view: View,
        *,
        spawn: Spawn,
        stage: Vehicles | None = None,
        sights: Sights | None = None,
    ) -> None:
        """``stage``, ``sights``: where the 3D view shows vehicles and what they see; None without a 3D view."""
        self._library, self._streams, self._spawn = library, streams, spawn
        self._plan_lane, self._file_lane = Lane("plan"), Lane("files", niceness=_FILES_NICENESS)
        self._board = JobBoard(self._file_lane, publish=streams.publish, spawn=spawn)
        self._computing = Computing(self._plan_lane, terrain_dir=library.terrain_dir, changed=self._computed)
        self._picture = Picture(view, library, self._plan_lane, changed=self._legend, failed=self._tell)
        self._desk = PlanDesk(library, changed=self._changed, saved=self._publish_plan, tell=streams.publish)
        self.files = FileJobs(
            library,
            self._board,
            propose=self._desk.propose,
            library_changed=self._publish_library,
            show_orthophoto=lambda: self._set_view(self.view.model_copy(update={"shading": "orthophoto"})),
        )
        self.stage, self.sights = stage, sights
        self._listed: tuple[str, str | None] | None = None
        self.changed: Callable[[], None] = lambda: None
        """Called after every change of the plan or its answer."""
        self.demo_is_open = asyncio.Event()
        self.view, self.selection = ViewDoc(), SelectionDoc()
        self.pointing = Pointing(
            self._desk, selection=lambda: self.selection, select=self._select, tell=streams.publish
        )

    # Life

    async def start(self, *, with_demo: bool = False) -> None:
        """Opens the plan that was open last, or the demo's; what has to be generated for it is a job of its own."""
        await self._desk.open_last()
        if with_demo and not await self._open_made_demo():
            self._spawn(self._make_demo())

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        """To be run by the application's task group until it ends."""
        return [self._computing.run(), self._picture.run(), self._desk.run(), self._warm_up()]

    async def close(self) -> None:
        await self._desk.close()
        await self._plan_lane.close()
        await self._file_lane.close()

    async def _warm_up(self) -> None:
        """Saves the first edit and the first file a wait. A failure shows itself again, and is told, in earnest."""
        if self._computing.state.state != "running":
            await _logged(self._plan_lane.call(tasks.warm_up), "Getting ready to plan")
        await _logged(self._board.unseen(lambda lane: lane.call(file_tasks.warm_up)), "Getting ready for files")

    # What flying needs

    @property
    def plan_lane(self) -> Lane:
        """Its worker holds the plan that was computed last."""
        return self._plan_lane

    @property
    def board(self) -> JobBoard:
        return self._board

    @property
    def picture(self) -> Picture:
        return self._picture

    @property
    def dsm(self) -> Dsm | None:
        """The surface model on show, at full resolution."""
        return self._picture.dsm

    @property
    def planned_home(self) -> tuple[float, float] | None:
        """(lat_deg, lon_deg) of the plan's home, as set or as computed."""
        place = self.document.home or (self.document.pois[0] if self.document.pois else None)
        if place is not None and (self.document.home is not None or self.document.source == "pois"):
            return place.lat_deg, place.lon_deg
        scene, dsm = self._computing.scene, self._picture.dsm
        if scene is None or dsm is None:
            return None
        lat_deg, lon_deg = dsm.lat_lon_from_xy(scene.home_m[None, :2])[0].tolist()
        return lat_deg, lon_deg

    @property
    def seen_columns(self) -> int:
        """Of the open plan's surface model that were raised by what was seen."""
        result = self._computing.state.result
        return 0 if self.document.seen_id is None or result is None else result.seen_columns

    async def plan_with_seen(self, maps: list[Voxels]) -> PlanState:
        """Raises the open plan's surface model where the maps have unexplained voxels; an edit like any other."""
        terrain_id = self.document.terrain_id
        if terrain_id is None:
            raise NotReadyError("There is no surface model to add to.", advice="Open the plan that is flown.")
        directory = self._library.terrain_dir(terrain_id)
        seen_id = await self._plan_lane.call(keep_seen, directory, maps)
        await self._desk.propose(
            lambda document: ("Plan against what was seen", document.model_copy(update={"seen_id": seen_id}))
        )
        return self.state

    async def plan_without_seen(self) -> PlanState:
        await self._desk.propose(
            lambda document: ("Plan without what was seen", document.model_copy(update={"seen_id": None}))
        )
        return self.state

    def show_review(self, terrain_id: str | None, scene: ReviewScene | None) -> None:
        """A recording in the 3D view instead of the plan; None: the plan again."""
        self._picture.show_review(terrain_id, scene)

    # What pages see

    @property
    def document(self) -> PlanDoc:
        return self._desk.document

    @property
    def state(self) -> PlanState:
        history = self._desk.history
        return PlanState(
            plan_id=self._desk.plan_id,
            revision=self._desk.revision,
            document=self.document,
            can_undo=history.can_undo,
            can_redo=history.can_redo,
            undo_label=history.undo_label,
            redo_label=history.redo_label,
            saved_utc=self._desk.saved_utc,
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

    # The plan

    async def edit(self, edit: PlanEdit) -> PlanState:
        """Raises StaleRevisionError when the plan has changed since ``base_revision``."""
        await self._desk.edit(edit)
        return self.state

    async def undo(self) -> PlanState:
        await self._desk.undo()
        return self.state

    async def redo(self) -> PlanState:
        await self._desk.redo()
        return self.state

    async def new(self) -> PlanState:
        await self._desk.create(lambda present: PlanDoc(terrain_id=present.terrain_id, profile=present.profile))
        return self.state

    async def open(self, plan_id: str) -> PlanState:
        try:
            await self._desk.open(plan_id)
        finally:
            # A damaged one has left the list.
            self._publish_library()
        return self.state

    async def save_as(self, name: str) -> PlanState:
        await self._desk.create(lambda present: present.model_copy(update={"name": name}))
        return self.state

    async def delete(self, plan_id: str) -> None:
        await self._desk.delete(plan_id)
        self._publish_library()

    # Points

    async def import_points(self, filename: str, data: bytes) -> Imported:
        """Replaces the points, or the polygon, by those of a file. Raises FormatError, PoiError."""
        points = await asyncio.to_thread(read_pois, filename, data)
        warnings = list(points.warnings)
        dsm = self._picture.dsm
        if dsm is not None and await asyncio.to_thread(looks_swapped, points.pois, dsm):
            warnings.append("Latitude and longitude seem swapped: exchanged, these points lie on the surface model.")
        await self._desk.propose(lambda document: (f"Import {filename[:40]}", with_points(document, points)))
        return Imported(state=self.state, warnings=warnings)

    async def shortest_order(self) -> PlanState:
        """Reorders the points to the shortest route that keeps the first one."""
        ordered = await ordering.shortest(self._plan_lane, self.document, self._picture.dsm)
        await self._desk.propose(lambda document: ("Shortest order", ordering.reordered(document, ordered)))
        return self.state

    # Files

    async def export(self, file: str) -> bytes:
        """One export file, or ``all.zip``, of the present document. Raises NotReadyError."""
        return await exported(self._plan_lane, self._library, self.document, file)

    async def add_demo_terrain(self) -> TerrainDoc:
        """The generated demo model with its plan, made on first use, opened."""
        await self._board.run("The demo", lambda lane, progress: demo.ensure_terrain(self._library, lane, progress))
        self._publish_library()
        return await self._open_demo(demo.terrain(self._library))

    async def _open_made_demo(self) -> bool:
        terrain = demo.terrain(self._library)
        if terrain is not None:
            await self._open_demo(terrain)
        return terrain is not None

    async def _open_demo(self, terrain: TerrainDoc | None) -> TerrainDoc:
        if terrain is None:
            raise NotFoundError("The demo surface model was deleted meanwhile.", advice="Try again.")
        await self.open(await asyncio.to_thread(demo.ensure_plan, self._library, terrain))
        self.demo_is_open.set()
        return terrain

    async def _make_demo(self) -> None:
        await _logged(self.add_demo_terrain(), "Making the demo")

    async def delete_terrain(self, terrain_id: str) -> None:
        """Raises InUseError while a plan needs it."""
        async with self._desk.editing:
            users = await asyncio.to_thread(self._library.plans_using, terrain_id)
            if self.document.terrain_id == terrain_id:
                users = [self.document.name, *users]
            if users:
                raise InUseError(
                    f"The surface model is used by the plan {users[0]!r}.",
                    advice="Delete that plan or give it another model first.",
                )
            await asyncio.to_thread(self._library.delete_terrain, terrain_id)
        self._publish_library()

    async def cancel_job(self, job_id: str) -> None:
        self._board.cancel(job_id)

    # Messages of pages

    async def on_client_message(self, page_id: str, message: ClientMessage) -> None:
        match message:
            case HoverProfile():
                self._streams.publish(await self._picture.mark(self._scene, message.s_m))
            case HoverView():
                place = None if message.x is None or message.y is None else (message.x, message.y)
                self._streams.publish(await self._picture.mark_under(self._scene, page_id, place))
            case SetView():
                self._set_view(message.view)
            case SetSelection():
                self._select(message.selection)
            case FrameView():
                await self._picture.frame(message, page_id)

    @property
    def _scene(self) -> PlanScene | None:
        """The plan on show; while a recording is, there is none to point at."""
        return None if self._picture.review is not None else self._computing.scene

    def _set_view(self, view: ViewDoc) -> None:
        self.view = view
        self._legend()
        self._show()

    def _select(self, selection: SelectionDoc) -> None:
        self.selection = selection
        self._streams.publish(SelectionMessage(selection=selection))
        self._show()

    # What follows

    def _changed(self, forget: bool) -> None:
        self._computing.request(self._desk.revision, self.document, forget=forget)
        if forget:
            self._select(SelectionDoc())
        listed = (self.document.name, self.document.terrain_id)
        if forget or listed != self._listed:
            self._publish_library()
        self._listed = listed
        self._computed()

    def _computed(self) -> None:
        self._show()
        self._publish_plan()

    def _legend(self) -> None:
        low_m, high_m = self._picture.legend_m or (None, None)
        self.view = self.view.model_copy(update={"legend_min_m": low_m, "legend_max_m": high_m})
        self._streams.publish(ViewMessage(view=self.view))

    def _tell(self, error: ErrorDoc) -> None:
        self._streams.publish(NoticeMessage(level="error", error=error))

    def _show(self) -> None:
        stale = self._computing.state.state == "running"
        self._picture.want(self.document, self.selection, self.view, self._computing.scene, stale=stale)

    def _publish_plan(self) -> None:
        self._streams.publish(PlanMessage(plan=self.state))
        self.changed()

    def _publish_library(self) -> None:
        self._streams.publish(LibraryMessage(library=self._library.state()))


async def _logged(work: Awaitable[object], doing: str) -> None:
    """For work in the background that must not end the server when it fails."""
    try:
        await work
    except Exception as error:
        doc = reported(error, log, doing)
        log.warning("%s: %s", doing, doc.what)
