"""Heavy work in processes of its own, one at a time per lane, with progress and cancel.

A lane is one worker process. Cancelling ends the process and the next call starts a fresh one, so that
neither numba nor GDAL can hold a cancelled job. Exceptions cross as they are; a worker that dies becomes
``WorkerDiedError``. All waiting happens in a thread of the lane's own: the event loop never waits.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from planning.terrain.rasters.confinement import plain_environment
from server.errors import BusyError, JobCancelledError, WorkerDiedError

Progress = Callable[[str, float | None], None]
T = TypeVar("T")

_REAP_S = 5.0
# Not multiprocessing's own way: that would import the server's main module, web frameworks and all, in every worker.
_PACKAGE = __name__.rpartition(".")[0]
_MAIN = f"import json, sys; sys.path[:] = json.loads(sys.argv[1]); from {_PACKAGE}.worker_process import main; main()"


class _Worker:
    """One process and the pipe to it."""

    def __init__(self, niceness: int) -> None:
        self._pipe, theirs = multiprocessing.Pipe()
        handle = theirs.fileno()
        arguments = [json.dumps(sys.path), str(handle), str(os.getpid()), str(niceness)]
        self._process = subprocess.Popen(
            [sys.executable, "-c", _MAIN, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            env=plain_environment(),
            pass_fds=[handle],
        )
        theirs.close()
        self.send, self.receive = self._pipe.send, self._pipe.recv

    def alive(self) -> bool:
        return self._process.poll() is None

    def kill(self) -> None:
        self._process.kill()

    def reap(self) -> None:
        """Only when nobody reads the pipe any more: its number may soon belong to another file."""
        self.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_REAP_S)
        self._pipe.close()


class Lane:
    """One worker process that runs one call at a time."""

    def __init__(self, name: str, *, niceness: int = 5) -> None:
        self._niceness = niceness
        self._lock = asyncio.Lock()
        self._worker: _Worker | None = None
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix=f"lane-{name}")
        self._running = self._cancelled = self._closed = False

    @property
    def running(self) -> bool:
        return self._running

    async def call(
        self, function: Callable[..., Any], /, *args: Any, progress: Progress | None = None, **kwargs: Any
    ) -> Any:
        """Runs ``function(*args, report=..., **kwargs)`` in the worker; ``report(step, share)`` feeds ``progress``."""
        async with self._lock:
            if self._closed:
                raise BusyError("Hedgehop is shutting down.", advice="Start it again.")
            self._cancelled, self._running = False, True
            try:
                kind, payload = await self._exchange((function, args, kwargs), progress)
            finally:
                self._running = False
        if kind == "error":
            raise payload
        return payload

    def cancel(self) -> None:
        """Ends the running call, if any, with ``JobCancelledError``."""
        if self._running:
            self._cancelled = True
            if self._worker is not None:
                self._worker.kill()

    async def close(self) -> None:
        """Ends the worker; a running call ends with ``JobCancelledError``, later ones are refused."""
        self._closed = self._cancelled = True
        if self._worker is not None:
            self._worker.kill()
        await asyncio.to_thread(self._thread.shutdown)
        # A worker that was being started when the lane was closed is here now.
        if self._worker is not None:
            await asyncio.to_thread(self._worker.reap)

    async def _exchange(self, request: tuple[Any, ...], progress: Progress | None) -> tuple[str, Any]:
        kind, payload, complete = "", None, False
        try:
            worker = await self._in_thread(self._ready_worker)
            if self._cancelled:
                raise _cancelled()
            await self._in_thread(lambda: worker.send(request))
            while not complete:
                kind, payload = await self._in_thread(worker.receive)
                complete = kind != "progress"
                if not complete and progress is not None:
                    progress(*payload)
        except (EOFError, OSError) as error:
            raise _cancelled() if self._cancelled else _died() from error
        finally:
            # Half an exchange would be answered in the next one, and a killed worker may look alive for a moment.
            if not complete or self._cancelled:
                self._discard()
        return kind, payload

    async def _in_thread(self, work: Callable[[], T]) -> T:
        if self._closed:
            raise _cancelled()
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)

    def _ready_worker(self) -> _Worker:
        if self._worker is None or not self._worker.alive():
            if self._worker is not None:
                self._worker.reap()
            self._worker = _Worker(self._niceness)
        return self._worker

    def _discard(self) -> None:
        if self._closed:
            # Whoever closes the lane reaps the worker too.
            return
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.kill()
            # After whatever still reads the pipe: the thread does one thing at a time.
            self._thread.submit(worker.reap)


def _cancelled() -> JobCancelledError:
    return JobCancelledError("The job was cancelled.")


def _died() -> WorkerDiedError:
    return WorkerDiedError(
        "The process that did the work ended unexpectedly, perhaps for lack of memory.",
        advice="Try again; if it happens again, use a smaller model.",
    )
