"""What pages, and the flight desk, ask of the open plan: each request is answered with the plan as it is then."""

from __future__ import annotations

import asyncio
import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from planning.errors import PoiError
from planning.report.exports import FILES
from planning.terrain.dsm import Dsm
from server.errors import ConflictError, NotReadyError
from server.library import Library
from server.library.documents import missing, taken_words, with_points
from server.library.fences import written_fence
from server.library.shelf import utc_now
from server.plan import file_tasks, tasks
from server.plan.computing import Computing
from server.plan.picture import Picture
from server.plan.plan_desk import PlanDesk
from server.scene.mirror import Voxels
from server.schemas import Imported, Pages, PlanDoc, PlanEdit, PlanState
from server.work.jobs import Lane
from telemetry.topics.vehicle import HomePlace, VehicleState

ALL = "all.zip"
MOST_POINTS = 1000
"""Beyond, finding the order takes minutes, and no vehicle holds so many."""


class PlanRequests:
    def __init__(
        self,
        desk: PlanDesk,
        computing: Computing,
        picture: Picture,
        library: Library,
        lane: Lane,
        pages: Pages,
    ) -> None:
        self._desk, self._computing, self._picture = desk, computing, picture
        self._library, self._lane, self._pages = library, lane, pages

    @property
    def state(self) -> PlanState:
        history = self._desk.history
        return PlanState(
            plan_id=self._desk.plan_id,
            revision=self._desk.revision,
            document=self._desk.document,
            can_undo=history.can_undo,
            can_redo=history.can_redo,
            undo_label=history.undo_label,
            redo_label=history.redo_label,
            saved_utc=self._desk.saved_utc,
            computation=self._computing.state,
        )

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
            self._pages.publish(self._library.message())
        return self.state

    async def save_as(self, name: str) -> PlanState:
        await self._desk.create(lambda present: present.model_copy(update={"name": name}))
        return self.state

    async def delete(self, plan_id: str) -> None:
        await self._desk.delete(plan_id)
        self._pages.publish(self._library.message())

    async def import_points(self, filename: str, upload: Path, *, only_fence: bool) -> Imported:
        """Replaces points, polygon or fence by those of an uploaded file. Raises FormatError, PoiError."""
        terrain_id = self._desk.document.terrain_id
        terrain_dir = None if self._picture.dsm is None or not terrain_id else self._library.terrain_dir(terrain_id)
        try:
            found, warnings = await self._lane.call(
                file_tasks.read_points, upload, filename, terrain_dir, only_fence=only_fence
            )
        finally:
            await asyncio.to_thread(upload.unlink, missing_ok=True)
        await self._desk.propose(lambda document: (f"Import {filename[:40]}", with_points(document, found)))
        taken = await asyncio.to_thread(taken_words, found)
        return Imported(state=self.state, warnings=list(warnings), taken=taken)

    async def shortest_order(self) -> PlanState:
        """Reorders the points to the shortest route that keeps the first one."""
        ordered = await shortest(self._lane, self._desk.document, self._picture.dsm)
        await self._desk.propose(lambda document: ("Shortest order", reordered(document, ordered)))
        return self.state

    async def export(self, file: str) -> bytes:
        """One export file, or ``all.zip``, of the present document. Raises NotReadyError."""
        return await exported(self._lane, self._library, self._desk.document, file)

    async def exported_fence(self, file: str) -> bytes:
        """Raises NotReadyError without a fence, FormatError for one that is none: to see that takes a while."""
        return await asyncio.to_thread(written_fence, self._desk.document, file)

    async def plan_with_seen(
        self,
        maps: list[Voxels],
        state: VehicleState | None,
        took_off: HomePlace | None,
        words: str,
        lacks: str,
        rest: Callable[[str], dict[str, Any]] | None = None,
    ) -> PlanState:
        """Raises the open plan's surface model where the maps have unexplained voxels; an edit like any other.

        ``state`` and ``took_off`` are the vehicle's, as in ``keep_seen``; ``words`` name the edit; ``lacks``: what was
        seen and is not in the maps, in words; ``rest`` gives, of the terrain's id, the fields of a plan that begins
        where the vehicle is.
        """
        terrain_id = self._desk.document.terrain_id
        if terrain_id is None:
            raise NotReadyError("There is no surface model to add to.", advice="Open the plan that is flown.")
        fields = {} if rest is None else await asyncio.to_thread(rest, terrain_id)
        directory = self._library.terrain_dir(terrain_id)
        fields["seen_id"] = await self._lane.call(tasks.keep_seen, directory, maps, state, took_off)
        fields["seen_lacks"] = lacks
        await self._desk.propose(lambda document: (words, document.model_copy(update=fields)))
        return self.state

    async def plan_without_seen(self) -> PlanState:
        await self._desk.propose(
            lambda document: (
                "Plan without what was seen",
                document.model_copy(update={"seen_id": None, "seen_lacks": ""}),
            )
        )
        return self.state


async def shortest(lane: Lane, document: PlanDoc, dsm: Dsm | None) -> list[str]:
    """Ids of the points in the shortest order that keeps the first. Raises PoiError."""
    if dsm is None or len(document.pois) < 3:
        raise PoiError("There is nothing to reorder.", advice="Choose a surface model and add three points or more.")
    if len(document.pois) > MOST_POINTS:
        raise PoiError(f"{len(document.pois)} points are too many to reorder: at most {MOST_POINTS}.")
    xy_m = dsm.xy_from_lat_lon(np.array([(poi.lat_deg, poi.lon_deg) for poi in document.pois]))
    if not np.isfinite(xy_m).all():
        raise PoiError("Some points are nowhere near the surface model.", advice="Move or delete them first.")
    order = await lane.call(tasks.order_points, xy_m)
    return [document.pois[i].id for i in order]


def reordered(document: PlanDoc, poi_ids: list[str]) -> PlanDoc:
    """Raises ConflictError when points have come or gone meanwhile."""
    by_id = {poi.id: poi for poi in document.pois}
    if len(document.pois) != len(poi_ids) or set(by_id) != set(poi_ids):
        raise ConflictError("The points have changed meanwhile.", advice="Order them again.")
    return document.model_copy(update={"pois": [by_id[poi_id] for poi_id in poi_ids]})


async def exported(lane: Lane, library: Library, document: PlanDoc, file: str) -> bytes:
    """One file of the plan, or all of them zipped. Raises NotReadyError, PlanningError."""
    hint = missing(document)
    if hint:
        raise NotReadyError("There is no plan to export yet.", advice=hint)
    directory = library.terrain_dir(document.terrain_id or "")
    names = list(FILES) if file == ALL else [file]
    files = await lane.call(tasks.export_plan, directory, document, names, utc_now())
    return await asyncio.to_thread(_zipped, files) if file == ALL else files[file]


def _zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()
