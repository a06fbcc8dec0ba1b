"""Jobs that an operator waits for: started, watched, cancelled, and kept on the board for a while."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from planning.errors import PlanningError
from server.errors import NotFoundError, ServerError, error_doc
from server.jobs import JobCancelledError, Lane, Progress
from server.schemas import JobDoc, JobMessage, ServerMessage

_KEPT_AFTER_END_S = 30.0
_EXPECTED = (PlanningError, ServerError)

Spawn = Callable[[Coroutine[Any, Any, None]], object]


class JobBoard:
    """Runs jobs one after the other on one lane and tells every page how far they are."""

    def __init__(self, lane: Lane, *, publish: Callable[[ServerMessage], None], spawn: Spawn) -> None:
        self._lane, self._publish, self._spawn = lane, publish, spawn
        self._jobs: dict[str, JobDoc] = {}
        self._queue = asyncio.Lock()
        self._running: str | None = None
        self._cancelled: set[str] = set()

    @property
    def jobs(self) -> list[JobDoc]:
        return list(self._jobs.values())

    def start(self, label: str, work: Callable[[Lane, Progress], Awaitable[object]]) -> JobDoc:
        """Puts ``work(lane, progress)`` on the board; its outcome is published, never raised."""
        job = JobDoc(id=secrets.token_hex(8), label=label, state="running", step="Waiting")
        self._set(job)
        self._spawn(self._run(job.id, work))
        return job

    def cancel(self, job_id: str) -> None:
        if job_id not in self._jobs:
            raise NotFoundError("There is no such job.", where=job_id)
        if self._jobs[job_id].state == "running":
            self._cancelled.add(job_id)
            if self._running == job_id:
                self._lane.cancel()

    async def _run(self, job_id: str, work: Callable[[Lane, Progress], Awaitable[object]]) -> None:
        async with self._queue:
            self._running = job_id
            try:
                if job_id not in self._cancelled:
                    await work(self._lane, lambda step, share: self._update(job_id, step=step, progress=share))
                self._end(job_id, "cancelled" if job_id in self._cancelled else "done")
            except JobCancelledError:
                self._end(job_id, "cancelled")
            except _EXPECTED as error:
                self._update(job_id, state="failed", error=error_doc(error))
            finally:
                self._running = None
                self._cancelled.discard(job_id)
        await asyncio.sleep(_KEPT_AFTER_END_S)
        self._jobs.pop(job_id, None)

    def _end(self, job_id: str, state: str) -> None:
        self._update(job_id, state=state, step="", progress=1.0 if state == "done" else None)

    def _update(self, job_id: str, **changes: object) -> None:
        self._set(self._jobs[job_id].model_copy(update=changes))

    def _set(self, job: JobDoc) -> None:
        self._jobs[job.id] = job
        self._publish(JobMessage(job=job))
