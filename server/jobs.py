"""Heavy work in processes of its own, one at a time per lane, with progress and cancel.

A lane is one worker process. Cancelling ends the process and the next call starts a fresh one, so that
neither numba nor GDAL can hold a cancelled job. Exceptions cross as they are; a worker that dies becomes
``WorkerDiedError``. Reading the pipe happens in a thread of the lane's own: the event loop never waits.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from server.errors import ServerError

Progress = Callable[[str, float | None], None]

_NICENESS = 5
_JOIN_S = 2.0


class WorkerDiedError(ServerError):
    """The worker process ended without an answer (killed, out of memory)."""

    code = "worker_died"


class JobCancelledError(RuntimeError):
    """Somebody cancelled the job."""


class Lane:
    """One worker process that runs one call at a time."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._lock = asyncio.Lock()
        self._pipe: Connection | None = None
        self._process: BaseProcess | None = None
        self._reader = ThreadPoolExecutor(max_workers=1, thread_name_prefix=f"lane-{name}")
        self._cancelled = False
        self._running = False

    @property
    def running(self) -> bool:
        return self._running

    async def call(
        self, function: Callable[..., Any], /, *args: Any, progress: Progress | None = None, **kwargs: Any
    ) -> Any:
        """Runs ``function(*args, report=..., **kwargs)`` in the worker; ``report(step, share)`` feeds ``progress``."""
        async with self._lock:
            self._cancelled, self._running = False, True
            try:
                return await self._exchange((function, args, kwargs), progress)
            except (EOFError, OSError) as error:
                self._discard()
                if self._cancelled:
                    raise JobCancelledError("The job was cancelled.") from None
                raise WorkerDiedError(
                    "The process that did the work ended unexpectedly, perhaps for lack of memory.",
                    advice="Try again; if it happens again, use a smaller model.",
                ) from error
            except asyncio.CancelledError:
                self._discard()
                raise
            finally:
                self._running = False

    async def _exchange(self, request: tuple[Any, ...], progress: Progress | None) -> Any:
        loop = asyncio.get_running_loop()
        pipe = await loop.run_in_executor(self._reader, self._ready_pipe)
        await loop.run_in_executor(self._reader, pipe.send, request)
        while True:
            kind, payload = await loop.run_in_executor(self._reader, pipe.recv)
            if kind == "progress":
                if progress is not None:
                    progress(*payload)
            elif kind == "error":
                raise payload
            else:
                return payload

    def _ready_pipe(self) -> Connection:
        if self._process is not None and self._process.is_alive() and self._pipe is not None:
            return self._pipe
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        self._process = context.Process(
            target=_work, args=(theirs, os.getpid()), name=f"hedgehop-{self._name}", daemon=False
        )
        self._process.start()
        theirs.close()
        self._pipe = ours
        return ours

    def cancel(self) -> None:
        """Ends the running call, if any, with ``JobCancelledError``."""
        if self._running:
            self._cancelled = True
            self._kill()

    def _kill(self) -> None:
        if self._process is not None and self._process.is_alive():
            self._process.kill()

    def _discard(self) -> None:
        self._kill()
        if self._pipe is not None:
            self._pipe.close()
        self._pipe = self._process = None

    async def close(self) -> None:
        process = self._process
        self._cancelled = True
        self._kill()
        if process is not None:
            await asyncio.to_thread(process.join, _JOIN_S)
        self._discard()
        self._reader.shutdown(wait=False)


def _work(pipe: Connection, parent_pid: int) -> None:
    """The worker's main loop: one request, its progress, one answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.nice(_NICENESS)

    def report(step: str, share: float | None) -> None:
        if os.getppid() != parent_pid:
            raise SystemExit(0)
        pipe.send(("progress", (step, share)))

    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):
        while True:
            function, args, kwargs = pipe.recv()
            pipe.send(_answer(function, args, kwargs, report))


def _answer(function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any], report: Progress) -> Any:
    try:
        return "done", function(*args, report=report, **kwargs)
    except Exception as error:
        # Tracebacks do not survive pickling: the text does, as the cause's note.
        error.__traceback__ = None
        return "error", error
