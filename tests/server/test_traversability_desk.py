"""The desk of traversability: one map, that of the open model; what fails or is cancelled leaves what there was."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from planning.errors import FormatError
from planning.ground.landing_sites import CAUTION
from server.errors import JobCancelledError, NotFoundError, NotReadyError, StorageError
from server.schemas import LandingSiteDoc, LandingSitesBody, TraversabilityBody, TraversabilityState, ViewDoc
from server.traversability import task
from server.traversability.landing_site_task import FoundSites, find_sites
from server.traversability.traversability_desk import TraversabilityDesk
from server.work.job_board import JobBoard
from server.work.jobs import Lane
from tests.server.fakes import Told

KEPT = "hill/traversability.npz"
SITE = LandingSiteDoc(
    rank=1,
    lat_deg=37.0,
    lon_deg=15.0,
    alt_dsm_m=100.0,
    distance_m=3.0,
    slope_deg=1.0,
    roughness_m=0.01,
    obstacle_distance_m=9.0,
    reasons=["Slope 1.0 deg"],
)


def worked(text: str = "ready", uwb_log: str = "") -> task.Worked:
    codes: Any = {"before": np.ones((2, 2), np.uint8)}
    if uwb_log:
        codes |= {layer: np.full((2, 2), n, np.uint8) for n, layer in enumerate(("cleared", "probability"), 2)}
    return task.Worked(text, 0.3, 40, 12, 5 if uwb_log else 0, 6, uwb_log, 9, codes, 0.0, 0.0, 0.3)


class FakeLane:
    """Answers when it is told to; a file that a worker would write is written."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []
        self.answers: list[Any] = []
        self.gate = asyncio.Event()
        self.gate.set()

    async def call(self, function: Callable[..., Any], *args: Any, progress: Any = None) -> Any:
        del progress
        self.asked.append((function, *args))
        await self.gate.wait()
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        if isinstance(answer, task.Worked) and function is not task.read_again:
            next(a for a in reversed(args) if isinstance(a, Path) and a.name.startswith("map")).write_bytes(b"map")
        return answer

    def cancel(self) -> None:
        self.answers.insert(0, JobCancelledError("The job was cancelled."))
        self.gate.set()


class FakeLibrary:
    def __init__(self, root: Path) -> None:
        self.root, self.made = root, 0

    def terrain_dir(self, terrain_id: str) -> Path:
        if terrain_id == "gone":
            raise NotFoundError("There is no such surface model.")
        (self.root / terrain_id).mkdir(exist_ok=True)
        return self.root / terrain_id

    def new_upload(self, suffix: str = "") -> Path:
        self.made += 1
        return self.root / f"map{self.made}{suffix}"


class Desk:
    def __init__(self, root: Path) -> None:
        self.lane, self.root = FakeLane(), root
        self.told: list[TraversabilityState] = []
        self.shown: list[Any] = []
        lane = cast(Lane, self.lane)
        self.board = JobBoard(lane, Told(), cast(Any, SimpleNamespace(spawn=asyncio.ensure_future)))
        self.desk = TraversabilityDesk(
            cast(Any, FakeLibrary(root)),
            self.board,
            lane,
            cast(Any, self),
            show=lambda overlay, sites: self.shown.append((overlay, sites)),
        )
        self.terrain_id: str | None = "hill"
        self.view = ViewDoc(show_traversability=True)
        self.desk.on_document(self.terrain_id)
        self.desk.on_view(self.view)
        self.told.clear()

    def publish(self, message: Any) -> None:
        self.told.append(message.traversability)

    @property
    def state(self) -> TraversabilityState:
        return self.desk.state

    @property
    def files(self) -> list[str]:
        return sorted(str(path.relative_to(self.root)) for path in self.root.rglob("*") if path.is_file())

    async def until(self, done: Callable[[], bool]) -> None:
        async with asyncio.timeout(60):
            while not done():
                await asyncio.sleep(0.005)

    async def over(self) -> None:
        await self.until(lambda: all(job.state != "running" for job in self.board.jobs))
        await asyncio.sleep(0)

    async def ready(self, uwb_log: str = "") -> None:
        self.lane.answers.append(worked(uwb_log=uwb_log))
        self.desk.work_out(TraversabilityBody())
        await self.over()

    def log(self) -> Path:
        path = self.root / "upload.npz"
        path.write_bytes(b"log")
        return path


def test_a_map_is_worked_out_told_and_shown(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        await it.ready()
        assert [state.state for state in it.told] == ["working", "ready"]
        assert (it.state.terrain_id, it.state.cells, it.state.untraversable) == ("hill", 40, 12)
        assert len(it.state.legend) == len(it.state.legend_colors) == 2
        overlay, sites = it.shown[-1]
        assert (overlay.terrain_id, overlay.rgba.shape, sites) == ("hill", (2, 2, 4), ())
        assert it.files == [KEPT]
        await it.ready()
        assert it.files == [KEPT]

    asyncio.run(play())


def test_the_layer_on_show_is_the_views(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        await it.ready(uwb_log="walk.npz")
        count = len(it.shown)
        it.desk.on_view(it.view)
        assert len(it.shown) == count
        it.view = it.view.model_copy(update={"traversability_layer": "probability"})
        it.desk.on_view(it.view)
        assert len(it.shown) == count + 1
        assert it.told[-1].legend[0] == "Obstacle: under 10 %"
        it.view = it.view.model_copy(update={"show_traversability": False})
        it.desk.on_view(it.view)
        assert it.shown[-1] == (None, ())

    asyncio.run(play())


def test_what_fails_is_told_and_leaves_the_map_that_was_there(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        it.lane.answers.append(FormatError("No log.", where="walk.npz"))
        it.desk.clear_foliage(it.log(), "walk.npz")
        await it.over()
        assert (it.state.state, it.state.error and it.state.error.where) == ("failed", "walk.npz")
        await it.ready()
        assert it.state.error is None
        it.lane.answers.append(FormatError("No log.", where="walk.npz"))
        it.desk.clear_foliage(it.log(), "walk.npz")
        await it.over()
        assert (it.state.state, it.state.cells, it.state.error and it.state.error.what) == ("ready", 40, "No log.")
        assert it.files == [KEPT]

    asyncio.run(play())


def test_a_log_clears_the_map_that_is_there_and_leaves_the_sites(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        await it.ready()
        it.lane.answers += [FoundSites((SITE,)), worked(uwb_log="walk.npz")]
        await it.desk.sites(LandingSitesBody(lat_deg=37.0, lon_deg=15.0))
        it.desk.clear_foliage(it.log(), "walk.npz")
        await it.over()
        _, directory, source, target, log, name, params = it.lane.asked[-1]
        assert params is None, "the usual ones"
        assert (directory.name, source, target.name, log.name) == ("hill", tmp_path / KEPT, "map2.npz", "upload.npz")
        assert name == "walk.npz"
        assert (it.state.cleared, it.state.uwb_log, it.state.sites) == (5, "walk.npz", [SITE])
        assert it.files == [KEPT]

    asyncio.run(play())


def test_sites_are_shown_with_their_reason_or_why_there_is_none(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        body = LandingSitesBody(lat_deg=37.0, lon_deg=15.0)
        with pytest.raises(NotReadyError, match="not been worked out"):
            await it.desk.sites(body)
        await it.ready()
        it.lane.answers += [FoundSites((SITE,)), FoundSites((), "Too steep.")]
        state = await it.desk.sites(body)
        assert it.lane.asked[-1][0] is find_sites
        assert (state.sites, state.sites_near) == ([SITE], (37.0, 15.0))
        assert state.text == f"ready {CAUTION}"
        assert [mark.rank for mark in it.shown[-1][1]] == [1]
        assert (await it.desk.sites(body)).no_site == "Too steep."
        assert it.state.text == "ready"
        assert it.shown[-1][1] == ()

    asyncio.run(play())


def test_only_a_wish_to_forget_leaves_nothing_on_the_disk(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        await it.ready()
        it.desk.on_document(it.terrain_id)
        assert it.state.state == "ready"
        it.terrain_id = "plain"
        it.desk.on_document(it.terrain_id)
        assert it.told[-1] == TraversabilityState()
        assert (it.shown[-1], it.files) == ((None, ()), [KEPT])
        await it.ready()
        it.desk.forget()
        assert (it.state, it.files) == (TraversabilityState(), [KEPT])

    asyncio.run(play())


def test_what_was_worked_out_before_is_read_again_when_its_model_is_opened(tmp_path: Path) -> None:
    async def play() -> None:
        await Desk(tmp_path).ready()
        it = Desk(tmp_path)
        it.lane.answers.append(worked("again"))
        it.desk.on_document(it.terrain_id)
        await it.over()
        assert it.lane.asked == [(task.read_again, tmp_path / KEPT)]
        assert (it.state.state, it.state.text, it.state.cells) == ("ready", "again", 40)
        assert it.shown[-1][0].terrain_id == "hill"
        it.desk.on_document(it.terrain_id)
        assert len(it.lane.asked) == 1
        for terrain_id in ("plain", "gone", None):
            it.terrain_id = terrain_id
            it.desk.on_document(it.terrain_id)
            assert it.state == TraversabilityState()
        assert it.files == [KEPT]

    asyncio.run(play())


def test_kept_maps_that_are_damaged_are_said_and_worked_out_anew(tmp_path: Path) -> None:
    async def play() -> None:
        await Desk(tmp_path).ready()
        it = Desk(tmp_path)
        it.lane.answers.append(StorageError("The file is damaged.", where=KEPT))
        it.desk.on_document(it.terrain_id)
        await it.over()
        assert (it.state.state, it.state.cells, it.state.error and it.state.error.where) == ("failed", 0, KEPT)
        assert it.files == [KEPT]
        await it.ready()
        assert (it.state.state, it.state.error, it.files) == ("ready", None, [KEPT])

    asyncio.run(play())


def test_one_that_is_cancelled_or_forgotten_while_it_runs_or_waits_is_none(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        it.lane.gate.clear()
        job = it.desk.work_out(TraversabilityBody())
        await it.until(lambda: bool(it.lane.asked))
        waiting = it.desk.clear_foliage(it.log(), "walk.npz")
        it.board.cancel(waiting.id)
        await it.until(lambda: "upload.npz" not in it.files)
        await asyncio.sleep(0)
        assert (it.state.state, it.state.text) == ("working", "Working out slope and roughness")
        it.board.cancel(job.id)
        await it.over()
        assert (it.state, it.files) == (TraversabilityState(), [])
        it.lane.gate.clear()
        it.desk.work_out(TraversabilityBody())
        await it.until(lambda: len(it.lane.asked) == 2)
        it.desk.forget()
        await it.over()
        assert (it.state, it.files) == (TraversabilityState(), [])

    asyncio.run(play())


def test_a_log_that_is_dropped_in_meanwhile_waits_for_the_map(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        it.lane.answers += [worked(), worked(uwb_log="walk.npz")]
        it.desk.work_out(TraversabilityBody())
        it.desk.clear_foliage(it.log(), "walk.npz")
        await it.over()
        assert [state.text for state in it.told if state.state == "working"] == [
            "Working out slope and roughness",
            "Clearing foliage",
        ]
        assert it.lane.asked[-1][2] == tmp_path / KEPT
        assert (it.state.state, it.state.uwb_log, it.files) == ("ready", "walk.npz", [KEPT])

    asyncio.run(play())


def test_an_outcome_for_a_model_that_is_closed_by_then_is_dropped(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        it.lane.gate.clear()
        it.lane.answers.append(worked())
        it.desk.work_out(TraversabilityBody())
        await it.until(lambda: bool(it.lane.asked))
        it.terrain_id = None
        it.desk.on_document(it.terrain_id)
        await it.over()
        assert (it.state, it.files) == (TraversabilityState(), [])

    asyncio.run(play())


def test_without_a_model_or_a_log_it_says_so(tmp_path: Path) -> None:
    async def play() -> None:
        it = Desk(tmp_path)
        with pytest.raises(NotReadyError, match="not been worked out"):
            await it.desk.layer_file("before")
        await it.ready()
        with pytest.raises(NotReadyError, match="No radar log"):
            await it.desk.layer_file("time_in_view")
        it.lane.answers.append(b"II*")
        assert await it.desk.layer_file("before") == b"II*"
        for gone in (None, "gone"):
            it.desk.on_document(gone)
            with pytest.raises((NotReadyError, NotFoundError)):
                it.desk.clear_foliage(it.log(), "walk.npz")
            assert "upload.npz" not in it.files

    asyncio.run(play())
