"""Traversability of the open surface model: jobs that work it out, what came of them, and what pages and view show."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

from mapping.uwb.uwb_params import UwbParams
from planning.ground.landing_sites import CAUTION
from server.errors import BusyError, JobCancelledError, NotFoundError, NotReadyError, error_doc
from server.library import Library
from server.scene.geometry.payload import OverlayScene, SiteMark
from server.schemas import (
    ErrorDoc,
    JobDoc,
    LandingSiteDoc,
    LandingSitesBody,
    LayerName,
    Pages,
    TraversabilityBody,
    TraversabilityMessage,
    TraversabilityState,
    UwbLiveDoc,
    ViewDoc,
)
from server.traversability import task
from server.traversability.landing_site_task import find_sites
from server.traversability.maps import keep, kept_in, settle
from server.traversability.task import Worked
from server.traversability.told import Kept, Told
from server.work.job_board import JobBoard
from server.work.jobs import Lane, Progress

_OF_THE_RADAR: tuple[LayerName, ...] = ("probability", "time_in_view")
_ADVICE = 'Press "Work it out" first.'


def _said(worked: Worked, sites: list[LandingSiteDoc]) -> str:
    return f"{worked.text} {CAUTION}" if sites else worked.text


class TraversabilityDesk:
    """One map at a time, that of the open model. All methods belong to the event loop.

    ``show`` puts a layer and landing sites into the 3D view.
    """

    def __init__(
        self,
        library: Library,
        board: JobBoard,
        lane: Lane,
        pages: Pages,
        *,
        show: Callable[[OverlayScene | None, tuple[SiteMark, ...]], None],
    ) -> None:
        self._library, self._board, self._lane = library, board, lane
        self._told = Told(pages, show=show)
        self.open_terrain_id: str | None = None
        """Its maps are known, or are being worked out."""
        self._jobs: dict[str, str] = {}
        """Those that run or wait, in their order, and what each does."""

    @property
    def state(self) -> TraversabilityState:
        return self._told.state

    def message(self) -> TraversabilityMessage:
        """For a page that has just opened."""
        return self._told.message()

    # What operators ask for

    def work_out(self, body: TraversabilityBody) -> JobDoc:
        """Raises NotReadyError without a surface model, BusyError."""
        terrain_id, target = self._open_terrain(), self._library.new_upload(".npz")
        directory = self._library.terrain_dir(terrain_id)

        async def work(lane: Lane, progress: Progress) -> Worked:
            return await lane.call(task.work_out, directory, target, body.resolution_m, progress=progress)

        return self._start("Traversability", "Working out slope and roughness", terrain_id, work, made=target)

    def clear_foliage(self, upload: Path, name: str, params: UwbParams | None = None) -> JobDoc:
        """Takes in a radar log, which is deleted afterwards; works the map out first if there is none yet."""
        try:
            terrain_id, target = self._open_terrain(), self._library.new_upload(".npz")
            directory = self._library.terrain_dir(terrain_id)
        except Exception:
            upload.unlink(missing_ok=True)
            raise

        async def work(lane: Lane, progress: Progress) -> Worked:
            kept = self._told.kept
            source = None if kept is None or kept.terrain_id != terrain_id else kept.file
            return await lane.call(
                task.clear_foliage, directory, source, target, upload, name, params, progress=progress
            )

        return self._start(
            f"Traversability with {name}", "Clearing foliage", terrain_id, work, made=target, used_up=upload
        )

    async def sites(self, body: LandingSitesBody) -> TraversabilityState:
        """The best landing sites near a point, from the map before clearing. Raises NotReadyError, PlanningError."""
        kept = self._need()
        found = await self._lane.call(find_sites, kept.file, body)
        if self._told.kept is kept:
            near = (body.lat_deg, body.lon_deg)
            sites = list(found.sites)
            said = {} if self._jobs else {"text": _said(kept.worked, sites)}
            self._told.change(sites_near=near, sites=sites, no_site=found.no_site, **said)
        return self.state

    async def layer_file(self, layer: LayerName) -> bytes:
        """A GeoTIFF. Raises NotReadyError."""
        kept = self._need()
        if layer in _OF_THE_RADAR and not kept.worked.uwb_log:
            raise NotReadyError("No radar log has been taken in yet.", advice="Drop a UWB radar log first.")
        return await self._lane.call(task.layer_file, kept.file, layer)

    def forget(self) -> None:
        """Nothing is kept any more; what is being worked out is cancelled."""
        self._close()
        directory = self._folder(self.open_terrain_id)
        if directory is not None:
            kept_in(directory).unlink(missing_ok=True)

    # A radar that scans now

    def tell_live(self, live: UwbLiveDoc) -> None:
        self._told.live = live
        self._told.publish()

    async def clear_live(self, log: Path, name: str, params: UwbParams) -> None:
        """As ``clear_foliage``, for what no operator waits for: in turn with the jobs, and without a word of it.

        Raises NotReadyError without a surface model, and what stands against the log.
        """
        terrain_id, target = self._open_terrain(), self._library.new_upload(".npz")
        directory, kept = self._library.terrain_dir(terrain_id), self._told.kept
        source = None if kept is None or kept.terrain_id != terrain_id else kept.file

        async def work(lane: Lane) -> None:
            worked = await lane.call(task.clear_foliage, directory, source, target, log, name, params)
            if self.open_terrain_id == terrain_id and self._told.kept is kept:
                self._take(Kept(terrain_id, keep(target, directory), worked))
                await asyncio.to_thread(settle, directory)

        try:
            await self._board.unseen(work)
        finally:
            target.unlink(missing_ok=True)

    # What else changes

    def on_document(self, present: str | None) -> None:
        """Another surface model may be open now: what is kept of it is read again."""
        if present == self.open_terrain_id:
            return
        self.open_terrain_id = present
        self._close()
        directory = self._folder(present)
        if present is not None and directory is not None and kept_in(directory).is_file():
            self._read_again(present, kept_in(directory))

    def on_view(self, view: ViewDoc) -> None:
        """Another layer, or none, is to be shown."""
        self._told.view = view
        self._told.publish()

    # How

    def _close(self) -> None:
        jobs, self._jobs = self._jobs, {}
        for job_id in jobs:
            self._board.cancel(job_id)
        self._told.replace(TraversabilityState(), None)

    def _folder(self, terrain_id: str | None) -> Path | None:
        """None for a surface model that is not there (any more)."""
        try:
            return None if terrain_id is None else self._library.terrain_dir(terrain_id)
        except NotFoundError:
            return None

    def _read_again(self, terrain_id: str, file: Path) -> None:
        async def work(lane: Lane, progress: Progress) -> Worked:
            return await lane.call(task.read_again, file, progress=progress)

        try:
            self._start("Traversability", "Reading what was worked out before", terrain_id, work)
        except BusyError as error:
            self._told.change(state="failed", error=error_doc(error))

    def _start(
        self,
        label: str,
        doing: str,
        terrain_id: str,
        work: Callable[[Lane, Progress], Awaitable[Worked]],
        *,
        made: Path | None = None,
        used_up: Path | None = None,
    ) -> JobDoc:
        """``made``: where ``work`` leaves new maps; without it, it reads those that are kept."""
        ids: list[str] = []
        loop, directory = asyncio.get_running_loop(), self._library.terrain_dir(terrain_id)

        def clean() -> None:
            for file in (used_up, made):
                if file is not None:
                    file.unlink(missing_ok=True)
            if ids:
                # One that is cancelled while it waits never begins.
                loop.call_soon_threadsafe(self._ended, ids[0], None)

        async def run(lane: Lane, progress: Progress) -> None:
            try:
                worked = await work(lane, progress)
                if ids[0] not in self._jobs:
                    # Put away meanwhile, or another model is open.
                    return
                file = kept_in(directory) if made is None else keep(made, directory)
            except Exception as error:
                cancelled = isinstance(error, JobCancelledError)
                self._ended(ids[0], None if cancelled else error_doc(error))
                raise
            del self._jobs[ids[0]]
            self._take(Kept(terrain_id, file, worked))
            if made is not None:
                await asyncio.to_thread(settle, directory)

        job = self._board.start(label, run, clean=clean)
        ids.append(job.id)
        self._jobs[job.id] = doing
        self._told.change(error=None, terrain_id=terrain_id, **self._at_work())
        return job

    def _take(self, kept: Kept) -> None:
        state = kept.state()
        before = self._told.kept
        if before is not None and before.terrain_id == kept.terrain_id and kept.worked.uwb_log:
            # Landing sites come from the map before clearing: a radar log changes none of them.
            same = self.state
            text = _said(kept.worked, same.sites)
            state = state.model_copy(
                update={"text": text, "sites_near": same.sites_near, "sites": same.sites, "no_site": same.no_site}
            )
        self._told.replace(state.model_copy(update=self._at_work()), kept)

    def _ended(self, job_id: str, error: ErrorDoc | None) -> None:
        """Without an outcome: what there was before stays. None: it was cancelled."""
        if self._jobs.pop(job_id, None) is None:
            return
        if self._jobs:
            self._told.change(error=error, **self._at_work())
        elif self._told.kept is not None:
            self._told.change(state="ready", text=_said(self._told.kept.worked, self.state.sites), error=error)
        elif error is None:
            self._told.replace(TraversabilityState(), None)
        else:
            self._told.change(state="failed", text="", error=error)

    def _at_work(self) -> dict[str, object]:
        """What the state says while jobs run; nothing when none does."""
        return {"state": "working", "text": next(iter(self._jobs.values()))} if self._jobs else {}

    def _open_terrain(self) -> str:
        if self.open_terrain_id is None:
            raise NotReadyError("There is no surface model open.", advice="Add one, or open a plan that has one.")
        return self.open_terrain_id

    def _need(self) -> Kept:
        if self._told.kept is None:
            raise NotReadyError("The traversability has not been worked out yet.", advice=_ADVICE)
        return self._told.kept
