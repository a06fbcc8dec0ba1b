"""Jobs that an operator waits for: started, watched, cancelled, and kept on the board for a while."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

from server.errors import BusyError, JobCancelledError, NotFoundError, reported
from server.schemas import JobDoc, JobMessage, Pages
from server.work.jobs import Lane, Progress
from server.work.task_group import Background

log = logging.getLogger("hedgehop.jobs")

KEPT_AFTER_END_S = 30.0
WAITING_MAX = 20
"""Each may hold an upload of the largest size on the disk."""

T = TypeVar("T")
Work = Callable[[Lane, Progress], Awaitable[object]]


def _nothing() -> None:
    """What most jobs leave behind."""


class JobBoard:
    """Runs jobs one after the other on one lane and tells every page how far they are."""

    def __init__(
        self,
        lane: Lane,
        pages: Pages,
        background: Background,
        *,
        kept_after_end_s: float = KEPT_AFTER_END_S,
    ) -> None:
        self._lane, self._pages, self._background = lane, pages, background
        self._kept_after_end_s = kept_after_end_s
        self._jobs: dict[str, JobDoc] = {}
        self._turn = asyncio.Lock()
        self._waiting: dict[str, asyncio.Task[Any]] = {}
        self._running: str | None = None
        self._cancelled: set[str] = set()

    @property
    def jobs(self) -> list[JobDoc]:
        return list(self._jobs.values())

    def start(self, label: str, work: Work, *, clean: Callable[[], object] = _nothing) -> JobDoc:
        """Puts ``work(lane, progress)`` on the board; its outcome is published, never raised.

        ``clean()`` runs in a thread once the job is over, however it ended, and also when it never began.
        Raises BusyError when too many wait; then ``clean`` has run.
        """
        if len(self._waiting) >= WAITING_MAX:
            clean()
            raise BusyError(f"{WAITING_MAX} jobs are waiting already.", advice="Let them finish, or cancel some.")
        job = JobDoc(id=secrets.token_hex(8), label=label, state="running", step="Waiting")
        self._waiting[job.id] = self._background.spawn(self._run(job.id, label, work, clean))
        self._set(job)
        return job

    async def run(self, label: str, work: Callable[[Lane, Progress], Awaitable[T]]) -> T:
        """A job whose outcome somebody waits for: returned or raised, and published like every other."""
        outcome: list[T | Exception] = []

        async def kept(lane: Lane, progress: Progress) -> None:
            try:
                outcome.append(await work(lane, progress))
            except Exception as error:
                outcome.append(error)
                raise

        job = self.start(label, kept)
        await asyncio.wait([self._waiting[job.id]])
        if not outcome:
            raise JobCancelledError("The job was cancelled.", where=label)
        if isinstance(outcome[0], Exception):
            raise outcome[0]
        return outcome[0]

    async def unseen(self, work: Callable[[Lane], Awaitable[object]]) -> None:
        """In turn with the jobs, for what no operator waits for."""
        async with self._turn:
            await work(self._lane)

    def cancel(self, job_id: str) -> None:
        if job_id not in self._jobs:
            raise NotFoundError("There is no such job.", where=job_id[:40], advice="It may be over already.")
        if self._jobs[job_id].state != "running":
            return
        self._cancelled.add(job_id)
        if job_id == self._running:
            self._lane.cancel()
        elif job_id in self._waiting:
            # Not at once: a task that has not begun yet would be gone without a word.
            asyncio.get_running_loop().call_soon(self._waiting[job_id].cancel)

    async def _run(self, job_id: str, label: str, work: Work, clean: Callable[[], object]) -> None:
        try:
            end = await self._in_turn(job_id, label, work)
        except asyncio.CancelledError:
            # While it waited; without a request to cancel it is the server that ends.
            if job_id not in self._cancelled:
                raise
            end = {"state": "cancelled"}
        finally:
            self._waiting.pop(job_id, None)
            await asyncio.to_thread(clean)
            self._cancelled.discard(job_id)
        self._set(self._jobs[job_id].model_copy(update={"step": "", "progress": None, **end}))
        asyncio.get_running_loop().call_later(self._kept_after_end_s, self._jobs.pop, job_id, None)

    async def _in_turn(self, job_id: str, label: str, work: Work) -> dict[str, object]:
        """How it ended."""
        async with self._turn:
            self._waiting.pop(job_id, None)
            self._running = job_id
            try:
                await work(self._lane, lambda step, share: self._progress(job_id, step, share))
                return {"state": "done", "progress": 1.0}
            except JobCancelledError:
                return {"state": "cancelled"}
            except Exception as error:
                return {"state": "failed", "error": reported(error, log, label)}
            finally:
                self._running = None

    def _progress(self, job_id: str, step: str, share: float | None) -> None:
        self._set(self._jobs[job_id].model_copy(update={"step": step, "progress": share}))

    def _set(self, job: JobDoc) -> None:
        self._jobs[job.id] = job
        self._pages.publish(JobMessage(job=job))
