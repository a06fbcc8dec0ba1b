"""The worker process of a lane: receives a call, reports progress, sends the answer, and waits for the next."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from planning.errors import DescribedError
from planning.terrain.rasters.confinement import confine
from server.errors import WorkerDiedError

Report = Callable[[str, float | None], None]


def main() -> None:
    """Arguments: the pipe's file descriptor, the server's process id, the niceness."""
    handle, parent_pid, niceness = (int(argument) for argument in sys.argv[-3:])
    # Ctrl-C reaches the whole group; the server decides when its workers end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.nice(niceness)
    # It starts programs of its own: the decoders of rasters.
    confine(runs_programs=True)
    serve(Connection(handle), parent_pid)


def serve(pipe: Connection, parent_pid: int) -> None:
    """Until the server's end of the pipe closes."""

    def report(step: str, share: float | None) -> None:
        if os.getppid() != parent_pid:
            raise SystemExit(0)
        pipe.send(("progress", (step, share)))

    with contextlib.suppress(EOFError, ConnectionError):
        while True:
            function, args, kwargs = pipe.recv()
            pipe.send(_answer(function, args, kwargs, report))


def _answer(function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any], report: Report) -> Any:
    try:
        return "done", function(*args, report=report, **kwargs)
    except DescribedError as error:
        return "error", error
    except MemoryError:
        return "error", WorkerDiedError(
            "There is not enough memory for this.", advice="Use a smaller or coarser surface model."
        )
    except Exception as error:
        return "error", _portable(error)


def _portable(error: Exception) -> Exception:
    """Tracebacks do not survive pickling: their text does, as a note. Some exceptions do not survive at all."""
    error.add_note(traceback.format_exc())
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        stand_in = RuntimeError(f"{type(error).__name__}: {error}")
        stand_in.add_note(traceback.format_exc())
        return stand_in
    return error
