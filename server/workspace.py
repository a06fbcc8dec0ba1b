"""What all pages work on together, joined: the open plan, its answer, its picture, and the jobs that bring files in.

All methods run on the event loop; heavy work goes to worker lanes. Every page hears of every change.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Coroutine
from typing import Any

from planning.terrain.dsm import Dsm
from server.errors import reported
from server.library import Library
from server.plan import file_tasks, tasks
from server.plan.computing import Computing
from server.plan.file_jobs import FileJobs
from server.plan.on_show import OnShow
from server.plan.picture import Picture
from server.plan.plan_desk import PlanDesk
from server.plan.plan_requests import PlanRequests
from server.plan.pointing import Pointing
from server.plan.terrain_desk import TerrainDesk
from server.scene.host import SceneHost
from server.scene.layers.sights import Sights
from server.scene.layers.traffic_layer import TrafficStage
from server.scene.layers.vehicles import Vehicles
from server.scene.view import SceneView
from server.schemas import Pages, PlanDoc, PlanMessage, PlanState, SelectionDoc, ServerMessage, Snapshot
from server.traversability.traversability_desk import TraversabilityDesk
from server.work.job_board import JobBoard
from server.work.jobs import Lane
from server.work.task_group import Background

log = logging.getLogger("hedgehop.plan")

_FILES_NICENESS = 10
"""Reading files leaves the processor to the answer that an operator waits for."""


class Workspace:
    """One open plan at a time: a ground station has one task in hand."""

    def __init__(self, library: Library, pages: Pages, host: SceneHost, background: Background) -> None:
        self._library, self._pages, self._background = library, pages, background
        self.plan_lane, self._file_lane = Lane("plan"), Lane("files", niceness=_FILES_NICENESS)
        """The plan lane's worker holds the plan that was computed last."""
        self.board = JobBoard(self._file_lane, pages, background)
        self._view = SceneView(host, self)
        self._computing = Computing(self.plan_lane, library, changed=self._computed)
        self.picture = Picture(self._view, library, self.plan_lane, pages, changed=self._model_shown)
        self._desk = PlanDesk(library, pages, changed=self._changed, saved=self._publish_plan)
        self.plans = PlanRequests(self._desk, self._computing, self.picture, library, self.plan_lane, pages)
        self.terrains = TerrainDesk(library, self._desk, self.plans, self.board, pages)
        self.traversability = TraversabilityDesk(library, self.board, self.plan_lane, pages, show=self.picture.lay_over)
        self.on_show = OnShow(
            self.picture, self._desk, self._computing, pages, layers_changed=self.traversability.on_view
        )
        self.files = FileJobs(library, self.board, self._desk, self.on_show, pages)
        self.pointing = Pointing(self._desk, self.on_show, pages)
        self._listed: tuple[str, str | None] | None = None
        self.changed = asyncio.Event()
        """Set by every change of the plan or its answer; whoever flies by it clears it."""

    # Life

    async def start(self, *, with_demo: bool = False) -> None:
        """Opens the plan that was open last, or the demo's; what has to be generated for it is a job of its own."""
        await self._desk.open_last()
        if with_demo and not await self.terrains.open_made_demo():
            self._background.spawn(_logged(self.terrains.add_demo(), "Making the demo"))

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        """To be run by the application's task group until it ends."""
        return [self._view.run(), self._computing.run(), self.picture.run(), self._desk.run(), self._warm_up()]

    async def close(self) -> None:
        await self._desk.close()
        await self.plan_lane.close()
        await self._file_lane.close()

    async def _warm_up(self) -> None:
        """Saves the first edit and the first file a wait. A failure shows itself again, and is told, in earnest."""
        if self._computing.state.state != "running":
            await _logged(self.plan_lane.call(tasks.warm_up), "Getting ready to plan")
        await _logged(self.board.unseen(lambda lane: lane.call(file_tasks.warm_up)), "Getting ready for files")

    # What flying needs

    @property
    def stage(self) -> Vehicles:
        """Where the 3D view shows vehicles."""
        return self._view.vehicles

    @property
    def sights(self) -> Sights:
        """Where the 3D view shows what they see."""
        return self._view.sights

    @property
    def traffic_stage(self) -> TrafficStage:
        """Where the 3D view shows other aircraft."""
        return self._view.traffic

    @property
    def dsm(self) -> Dsm | None:
        """The surface model on show, at full resolution."""
        return self.picture.dsm

    @property
    def planned_home(self) -> tuple[float, float] | None:
        """(lat_deg, lon_deg) of the plan's home, as set or as computed."""
        place = self.document.home or (self.document.pois[0] if self.document.pois else None)
        if place is not None and (self.document.home is not None or self.document.source == "pois"):
            return place.lat_deg, place.lon_deg
        scene, dsm = self._computing.scene, self.picture.dsm
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
            jobs=self.board.jobs,
        )

    def present(self) -> list[ServerMessage]:
        """What a page is told right after its snapshot."""
        return [self.traversability.message()]

    # What hands in the 3D view do

    async def on_terrain_click(self, lat_deg: float, lon_deg: float, known: bool) -> None:
        await self.pointing.on_terrain(lat_deg, lon_deg, known=known)

    async def on_mark_click(self, mark: str) -> None:
        self.pointing.on_mark(mark)

    async def on_mark_moved(self, mark: str, lat_deg: float, lon_deg: float) -> None:
        await self.pointing.on_mark_moved(mark, lat_deg, lon_deg)

    # What follows

    def _changed(self, forget: bool) -> None:
        self._computing.request(self._desk.revision, self.document, forget=forget)
        if forget:
            self.on_show.select(SelectionDoc())
        listed = (self.document.name, self.document.terrain_id)
        if forget or listed != self._listed:
            self._pages.publish(self._library.message())
        self._listed = listed
        self.traversability.on_document(self.document.terrain_id)
        self._computed()

    def _computed(self) -> None:
        self.on_show.draw()
        self._publish_plan()

    def _model_shown(self) -> None:
        self.on_show.tell_legend()

    def _publish_plan(self) -> None:
        self._pages.publish(PlanMessage(plan=self.state))
        self.changed.set()


async def _logged(work: Awaitable[object], doing: str) -> None:
    """For work in the background that must not end the server when it fails."""
    try:
        await work
    except Exception as error:
        doc = reported(error, log, doing)
        log.warning("%s: %s", doing, doc.what)
