"""What all pages work on together, joined: the open plan, its answer, its picture, and the jobs that bring files in.

All methods run on the event loop; heavy work goes to worker lanes. Every page hears of every change.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, Protocol

from planning.terrain.dsm import Dsm
from server.errors import reported
from server.library import Library
from server.plan import file_tasks, tasks
from server.plan.computing import Computing
from server.plan.file_jobs import FileJobs
from server.plan.on_show import OnShow
from server.plan.picture import Picture, View
from server.plan.plan_desk import PlanDesk
from server.plan.plan_requests import PlanRequests
from server.plan.pointing import Pointing
from server.plan.terrain_desk import TerrainDesk
from server.scene.layers.sights import Sights
from server.scene.layers.vehicles import Vehicles
from server.schemas import (
    ErrorDoc,
    LibraryMessage,
    NoticeMessage,
    PlanDoc,
    PlanMessage,
    PlanState,
    SelectionDoc,
    ServerMessage,
    Snapshot,
)
from server.traversability.traversability_desk import TraversabilityDesk
from server.work.job_board import JobBoard, Spawn
from server.work.jobs import Lane

log = logging.getLogger("hedgehop.plan")

_FILES_NICENESS = 10
"""Reading files leaves the processor to the answer that an operator waits for."""


class Streams(Protocol):
    """The part of ``server.door.hub.Hub`` that the workspace uses."""

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
        self._library, self._publish, self._spawn = library, streams.publish, spawn
        self._plan_lane, self._file_lane = Lane("plan"), Lane("files", niceness=_FILES_NICENESS)
        self._board = JobBoard(self._file_lane, publish=self._publish, spawn=spawn)
        self._computing = Computing(self._plan_lane, terrain_dir=library.terrain_dir, changed=self._computed)
        self._picture = Picture(
            view, library, self._plan_lane, changed=lambda: self.on_show.tell_legend(), failed=self._tell
        )
        self._desk = PlanDesk(library, changed=self._changed, saved=self._publish_plan, tell=self._publish)
        self.plans = PlanRequests(
            self._desk,
            self._computing,
            library,
            self._plan_lane,
            dsm=lambda: self._picture.dsm,
            library_changed=self._publish_library,
        )
        self.terrains = TerrainDesk(
            library, self._desk, self._board, open_plan=self.plans.open, library_changed=self._publish_library
        )
        self.on_show = OnShow(
            self._picture,
            self._desk,
            self._computing,
            layers_changed=lambda: self.traversability.on_view(),
            publish=self._publish,
        )
        self.files = FileJobs(
            library,
            self._board,
            propose=self._desk.propose,
            library_changed=self._publish_library,
            show_orthophoto=self.on_show.show_orthophoto,
        )
        self.traversability = TraversabilityDesk(
            library,
            self._board,
            self._plan_lane,
            terrain_id=lambda: self.document.terrain_id,
            view=lambda: self.on_show.view,
            tell=self._publish,
            show=self._picture.lay_over,
        )
        self.stage, self.sights = stage, sights
        self._listed: tuple[str, str | None] | None = None
        self.changed: Callable[[], None] = lambda: None
        """Called after every change of the plan or its answer."""
        self.pointing = Pointing(
            self._desk,
            selection=lambda: self.on_show.selection,
            select=self.on_show.select,
            tell=self._publish,
        )

    # Life

    async def start(self, *, with_demo: bool = False) -> None:
        """Opens the plan that was open last, or the demo's; what has to be generated for it is a job of its own."""
        await self._desk.open_last()
        if with_demo and not await self.terrains.open_made_demo():
            self._spawn(_logged(self.terrains.add_demo(), "Making the demo"))

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

    # What pages see

    @property
    def document(self) -> PlanDoc:
        return self._desk.document

    @property
    def state(self) -> PlanState:
        return self.plans.state

    def snapshot(self, page_id: str) -> Snapshot:
        return Snapshot(
            product_version=tasks.PRODUCT_VERSION,
            page_id=page_id,
            plan=self.state,
            library=self._library.state(),
            view=self.on_show.view,
            selection=self.on_show.selection,
            jobs=self._board.jobs,
        )

    def present(self) -> list[ServerMessage]:
        """What a page is told right after its snapshot."""
        return [self.traversability.message()]

    # What follows

    def _changed(self, forget: bool) -> None:
        self._computing.request(self._desk.revision, self.document, forget=forget)
        if forget:
            self.on_show.select(SelectionDoc())
        listed = (self.document.name, self.document.terrain_id)
        if forget or listed != self._listed:
            self._publish_library()
        self._listed = listed
        self.traversability.on_document()
        self._computed()

    def _computed(self) -> None:
        self.on_show.draw()
        self._publish_plan()

    def _tell(self, error: ErrorDoc) -> None:
        self._publish(NoticeMessage(level="error", error=error))

    def _publish_plan(self) -> None:
        self._publish(PlanMessage(plan=self.state))
        self.changed()

    def _publish_library(self) -> None:
        self._publish(LibraryMessage(library=self._library.state()))


async def _logged(work: Awaitable[object], doing: str) -> None:
    """For work in the background that must not end the server when it fails."""
    try:
        await work
    except Exception as error:
        doc = reported(error, log, doing)
        log.warning("%s: %s", doing, doc.what)
