"""Jobs in turn: outcome told, never raised; cancelled ones leave nothing. A real worker."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import pytest

from planning.errors import RasterError
from server.errors import BusyError, JobCancelledError, NotFoundError
from server.schemas import JobDoc, JobMessage, ServerMessage
from server.work.job_board import WAITING_MAX, JobBoard
from server.work.jobs import Lane, Progress
from server.work.task_group import Background


def _sleep(seconds: float, *, report: Any) -> None:
    report("asleep", 0.5)
    time.sleep(seconds)


def _refuse(*, report: Any) -> None:
    raise RasterError("It is no raster.", where="a.tif", advice="Choose another.")


class Board:
    """A board, what it told, and a way to wait for it."""

    def __init__(self, lane: Lane, background: Background, kept_after_end_s: float) -> None:
        self.told: list[JobDoc] = []
        self._news = asyncio.Event()
        self.board = JobBoard(lane, self, background, kept_after_end_s=kept_after_end_s)
        self.cleaned: list[str] = []

    def publish(self, message: ServerMessage) -> None:
        assert isinstance(message, JobMessage)
        self.told.append(message.job)
        self._news.set()

    def start(self, name: str, work: Callable[[Lane, Progress], Awaitable[object]]) -> str:
        return self.board.start(name, work, clean=lambda: self.cleaned.append(name)).id

    async def until(self, job_id: str, fits: Callable[[JobDoc], bool]) -> JobDoc:
        async with asyncio.timeout(60):
            while True:
                for job in self.told:
                    if job.id == job_id and fits(job):
                        return job
                self._news.clear()
                await self._news.wait()

    async def ended(self, job_id: str) -> JobDoc:
        return await self.until(job_id, lambda job: job.state != "running")


Run = Callable[..., None]


@pytest.fixture(scope="module")
def run() -> Iterator[Run]:
    """Runs with one lane for all: a worker takes seconds to start."""
    with asyncio.Runner() as runner:
        lane = Lane("test")

        def run(use: Callable[[Board], Awaitable[None]], *, kept_after_end_s: float = 60.0) -> None:
            async def whole() -> None:
                async with asyncio.TaskGroup() as group:
                    background = Background(group)
                    try:
                        await use(Board(lane, background, kept_after_end_s))
                    finally:
                        background.stop()

            runner.run(whole())

        yield run
        runner.run(lane.close())


async def sleeping(lane: Lane, progress: Progress) -> None:
    await lane.call(_sleep, 60.0, progress=progress)


async def nothing(lane: Lane, progress: Progress) -> None:
    progress("Working", 0.25)


def test_progress_and_the_end_are_told(run: Run) -> None:
    async def use(board: Board) -> None:
        job_id = board.start("a", nothing)
        done = await board.ended(job_id)
        assert (done.state, done.progress, done.error) == ("done", 1.0, None)
        assert [(job.step, job.progress) for job in board.told[:2]] == [("Waiting", None), ("Working", 0.25)]
        assert board.cleaned == ["a"]

    run(use)


def test_errors_are_told_and_the_next_job_runs(run: Run) -> None:
    async def defect(lane: Lane, progress: Progress) -> None:
        raise ZeroDivisionError("a secret detail")

    async def use(board: Board) -> None:
        jobs = [
            board.start("a", lambda lane, progress: lane.call(_refuse)),
            board.start("b", defect),
            board.start("c", nothing),
        ]
        ended = [await board.ended(job) for job in jobs]
        assert [job.state for job in ended] == ["failed", "failed", "done"]
        assert [job.error.code for job in ended if job.error] == ["raster", "internal"]
        assert board.cleaned == ["a", "b", "c"]

    run(use)


def test_running_and_waiting_jobs_are_cancelled(run: Run) -> None:
    async def use(board: Board) -> None:
        first, second, third = (board.start(name, sleeping) for name in "abc")
        await board.until(first, lambda job: job.step == "asleep")
        board.board.cancel(second)
        # At once, not when its turn comes.
        assert (await board.ended(second)).state == "cancelled"
        assert board.cleaned == ["b"]
        board.board.cancel(first)
        assert (await board.ended(first)).state == "cancelled"
        await board.until(third, lambda job: job.step == "asleep")
        board.board.cancel(third)
        assert (await board.ended(third)).state == "cancelled"
        board.board.cancel(third)
        assert board.cleaned == ["b", "a", "c"]

    run(use)


def test_ended_jobs_leave_the_board(run: Run) -> None:
    async def use(board: Board) -> None:
        job_id = board.start("a", nothing)
        await board.ended(job_id)
        async with asyncio.timeout(30):
            while board.board.jobs:
                await asyncio.sleep(0)
        with pytest.raises(NotFoundError):
            board.board.cancel(job_id)

    run(use, kept_after_end_s=0.0)


def test_too_many_waiting_jobs_are_refused(run: Run) -> None:
    async def use(board: Board) -> None:
        jobs = [board.start(str(number), sleeping) for number in range(WAITING_MAX)]
        with pytest.raises(BusyError):
            board.start("one more", sleeping)
        assert board.cleaned == ["one more"]
        for job in reversed(jobs):
            board.board.cancel(job)
        assert {(await board.ended(job)).state for job in jobs} == {"cancelled"}

    run(use)


def test_an_awaited_job_returns_or_raises(run: Run) -> None:
    async def answer(lane: Lane, progress: Progress) -> int:
        return 42

    async def use(board: Board) -> None:
        assert await board.board.run("a", answer) == 42
        with pytest.raises(RasterError, match="no raster"):
            await board.board.run("b", lambda lane, progress: lane.call(_refuse))
        running = asyncio.create_task(board.board.run("c", sleeping))
        waiting = asyncio.create_task(board.board.run("d", sleeping))
        async with asyncio.timeout(60):
            while not any(job.step == "asleep" for job in board.told):
                await asyncio.sleep(0)
        for job in reversed(board.board.jobs):
            board.board.cancel(job.id)
        outcome = await asyncio.gather(running, waiting, return_exceptions=True)
        assert [type(error) for error in outcome] == [JobCancelledError, JobCancelledError]

    run(use)
