"""Runs a raster job in a child process that a hostile or broken file may crash, exhaust or hang."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from planning.errors import NoElevationError, RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.rasters.confinement import plain_environment
from planning.terrain.rasters.header import RasterLimits

Json = dict[str, Any]
Progress = Callable[[str, float], None]

_PACKAGE = __name__.rpartition(".")[0]
_ROOT = Path(__file__).resolve().parents[__name__.count(".")]
_COMMAND = [sys.executable, "-P", "-m", f"{_PACKAGE}.worker"]
_LONGEST_MESSAGE = 2**22
_START_S = 120.0
"""Until a worker has its modules: a busy machine's time is no fault of the file's."""
_SMALLER = "Rewrite it as a tiled GeoTIFF, or crop it to the area of the flight."
_ERRORS = {"format": RasterFormatError, "too_large": RasterTooLargeError, "no_elevation": NoElevationError}
# GDAL reads these before Python can set them through rasterio.Env: drivers register on import.
_GDAL = {
    "GDAL_SKIP": "VRT DERIVED GTI WMS WMTS WCS HTTP PLMOSAIC STACIT STACTA EEDA EEDAI MRF ZARR netCDF HDF5",
    "GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR",
    "GDAL_PAM_ENABLED": "NO",
    "GDAL_GEOREF_SOURCES": "INTERNAL",
    "GDAL_DRIVER_PATH": "disable",
    "GDAL_CACHEMAX": "128",
    "GTIFF_REPORT_COMPD_CS": "YES",
    "CPL_VSIL_CURL_ALLOWED_EXTENSIONS": ".none",
    "PROJ_NETWORK": "OFF",
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "RAYON_NUM_THREADS": "2",  # of compressed point clouds
}


@contextmanager
def private_directory() -> Iterator[Path]:
    """A directory of our own (mode 0700): what lies beside a user's file is not beside it here."""
    try:
        directory = tempfile.TemporaryDirectory(prefix="hedgehop-raster-")
    except OSError as error:
        raise RasterError(
            f"There is no room for temporary files: {error.strerror}.",
            where=tempfile.gettempdir(),
            advice="Free some space, or point TMPDIR to a larger disk.",
        ) from error
    with directory as name:
        yield Path(name)


def run_job(
    job: Json,
    *,
    directory: Path,
    limits: RasterLimits,
    where: str,
    on_header: Callable[[Json], Json] | None = None,
    progress: Progress | None = None,
    smaller: str = _SMALLER,
    pipe: Sequence[int] = (),
) -> Json:
    """Send one job to a new worker and return its answer; the worker never outlives the call.

    ``on_header`` judges the header and returns the rest of the order; it may raise, as may ``progress``:
    both end the worker. It keeps the handles of a ``pipe``. Raises RasterError when the worker fails, dies or is
    late; ``smaller`` says what to do then.
    """
    with (directory / "stderr").open("w+b") as stderr:
        worker = _start(directory, stderr, *pipe)
        clock, is_ready = _Deadline(worker, _START_S), False
        try:
            bounds = {"memory_bytes": limits.max_memory_bytes, "cpu_s": int(limits.decode_s) + 1}
            _send(worker, {"writable": [str(directory)], **job, **bounds})
            for message in _messages(worker):
                kind = message.pop("type")
                if kind == "ready" and not is_ready:
                    is_ready = True
                    clock.extend(limits.header_s)
                elif kind == "header":
                    order = on_header(message) if on_header else {}
                    clock.extend(limits.decode_s)
                    _send(worker, order)
                elif kind == "progress" and progress:
                    progress(message["stage"], message["share"])
                elif kind == "done":
                    return message
                elif kind == "error":
                    error = _ERRORS.get(message["kind"], RasterError)
                    what, advice = (_public(message[part], directory, where) for part in ("what", "advice"))
                    raise error(what, where=where, advice=advice)
            worker.wait()
            raise _death(worker.returncode, clock.passed_s, is_ready=is_ready, where=where, smaller=smaller)
        except BrokenPipeError as error:
            worker.wait()
            raise _death(worker.returncode, clock.passed_s, is_ready=is_ready, where=where, smaller=smaller) from error
        finally:
            clock.stop()
            _end(worker)


def _public(text: str, directory: Path, where: str) -> str:
    """Libraries name the file by our own link to it: the operator's name in its place."""
    return re.sub(rf"{re.escape(str(directory))}[\w./-]*", lambda _: where or "the file", text)


def _start(directory: Path, stderr: IO[bytes], *pipe: int) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        _COMMAND,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        cwd=directory,
        env=_environment(),
        pass_fds=pipe,
        start_new_session=True,
    )


def _environment() -> dict[str, str]:
    kept = plain_environment()
    kept.pop("PYTHONWARNINGS", None)  # what the libraries warn of is no error of the file's
    paths = [str(_ROOT), *filter(None, [kept.get("PYTHONPATH")])]
    return {**kept, **_GDAL, "PYTHONPATH": os.pathsep.join(paths)}


def _send(worker: subprocess.Popen[bytes], message: Json) -> None:
    assert worker.stdin is not None
    worker.stdin.write(json.dumps(message).encode() + b"\n")
    worker.stdin.flush()


def _messages(worker: subprocess.Popen[bytes]) -> Iterator[Json]:
    assert worker.stdout is not None
    while line := worker.stdout.readline(_LONGEST_MESSAGE):
        try:
            message = json.loads(line)
        except ValueError:
            worker.kill()
            return
        yield message


def _end(worker: subprocess.Popen[bytes]) -> None:
    worker.kill()
    for pipe in (worker.stdin, worker.stdout):
        assert pipe is not None
        try:
            pipe.close()
        except BrokenPipeError:
            continue  # an order that a dead worker never read
    worker.wait()


def _death(returncode: int, late_after_s: float | None, *, is_ready: bool, where: str, smaller: str) -> RasterError:
    if late_after_s is not None and not is_ready:
        return RasterError(
            f"The decoder did not start within {late_after_s:.0f} s: this computer has too much else to do.",
            where=where,
            advice="Try again when less runs on it.",
        )
    if late_after_s is not None:
        return RasterTooLargeError(
            f"Decoding took more than {late_after_s:.0f} s and was stopped.",
            where=where,
            advice=smaller,
        )
    if returncode == -signal.SIGXCPU:
        return RasterTooLargeError(
            "Decoding used too much processor time and was stopped.", where=where, advice=smaller
        )
    cause = signal.Signals(-returncode).name if returncode < 0 else f"exit code {returncode}"
    return RasterFormatError(
        f"The decoder died of it ({cause}): the file is corrupt or hostile, or memory ran out.",
        where=where,
        advice=f"Export it again. {smaller}",
    )


class _Deadline:
    """Kills the worker when its time is up; ``passed_s`` then holds the time it was given."""

    def __init__(self, worker: subprocess.Popen[bytes], seconds: float) -> None:
        self._worker = worker
        self.passed_s: float | None = None
        self._timer = self._arm(seconds)

    def extend(self, seconds: float) -> None:
        self._timer.cancel()
        self._timer = self._arm(seconds)

    def stop(self) -> None:
        self._timer.cancel()
        self._timer.join()

    def _arm(self, seconds: float) -> threading.Timer:
        timer = threading.Timer(seconds, self._expire, [seconds])
        timer.daemon = True
        timer.start()
        return timer

    def _expire(self, seconds: float) -> None:
        self.passed_s = seconds
        self._worker.kill()
