"""The child process that decodes one raster, cloud, mesh or bag: a job comes on stdin, messages leave as lines of JSON.

Started by ``planning.terrain.rasters.sandbox`` with GDAL's settings already in the environment. It imports
little, so that it starts fast and its memory limit means something.
"""

from __future__ import annotations

import errno
import importlib
import json
import os
import resource
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from planning.errors import RasterFormatError
from planning.terrain.rasters.confinement import confine, confine_files

Json = dict[str, Any]

_OURS = __package__ or ""
_KINDS = {"read_cloud": "cloud", "read_mesh": "mesh", "list_bag": "bag", "read_bag": "bag"}
"""Of a job's file; all others are rasters."""
_SMALLER = {
    "raster": "Rewrite it as a tiled GeoTIFF.",
    "cloud": "Thin the cloud out, or crop it.",
    "mesh": "Export the mesh with fewer faces and smaller textures.",
    "bag": "Cut a shorter piece out of it, or one with fewer topics.",
}


def main() -> None:
    """Carry out one job, then exit; every failure becomes one "error" message."""
    to_parent = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # decoders may print: only messages go to the parent
    send = partial(_send, to_parent)
    job = _receive()
    _confine(job)
    try:
        # After the limits: GDAL registers its drivers on import.
        decoder = importlib.import_module(f"{job.get('decoder', _OURS)}.decode")

        confine_files(readable=_readable(job), writable=[Path(path) for path in job["writable"]])
        send("ready")
        decoder.JOBS[job["job"]](job, send, partial(_ask, send))
    except Exception as error:
        send("error", **_explain(error, job["job"]))


def _send(to_parent: TextIO, kind: str, /, **fields: Any) -> None:
    to_parent.write(json.dumps({"type": kind, **fields}) + "\n")
    to_parent.flush()


def _ask(send: Callable[..., None], header: Json) -> Json:
    """Show the header to the parent and wait for the rest of the order."""
    send("header", **header)
    order = _receive()
    threading.Thread(target=_die_with_parent, daemon=True).start()
    return order


def _receive() -> Json:
    line = sys.stdin.readline()
    if not line:
        os._exit(0)
    return json.loads(line)


def _die_with_parent() -> None:
    sys.stdin.read()  # returns when the parent closes the pipe, or is killed
    os._exit(0)


def _confine(job: Json) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (job["cpu_s"], job["cpu_s"] + 1))
    resource.setrlimit(resource.RLIMIT_AS, (job["memory_bytes"], job["memory_bytes"]))
    confine(runs_programs=False)


def _readable(job: Json) -> list[Path]:
    """The file, and what Python and GDAL may still load: their own folders and the system's."""
    from mapping.geometry import arrays

    floors = [Path(__file__).resolve().parents[2], Path(arrays.__file__).resolve().parents[1]]
    installed = [path for path in sys.path if Path(path) != floors[0].parent]
    data = [os.environ[name] for name in ("PROJ_DATA", "PROJ_LIB") if name in os.environ]
    theirs = [sys.prefix, sys.base_prefix, *installed, *data, "/usr", "/lib", "/lib64", "/etc", "/dev/null"]
    files = [file["source"] for file in job.get("tiles", [job]) if "source" in file]
    return [*(Path(file).resolve() for file in files), *floors, *map(Path, theirs)]


def _explain(error: Exception, job: str) -> Json:
    if isinstance(error, RasterFormatError):
        return {"kind": "format", "what": error.what, "advice": error.advice}
    cause, kind = str(error.__cause__ or error) or type(error).__name__, _KINDS.get(job, "raster")
    if isinstance(error, MemoryError) or "memory" in cause.lower() or "allocat" in cause.lower():
        return {
            "kind": "too_large",
            "what": f"Decoding needs more memory than allowed ({cause}).",
            "advice": _SMALLER[kind],
        }
    if isinstance(error, OSError) and error.errno == errno.EFBIG:
        return {
            "kind": "too_large",
            "what": "A file that is written for it becomes larger than is allowed.",
            "advice": _SMALLER[kind] if kind == "bag" else "Raise the limit on the size of files (ulimit -f).",
        }
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return {
            "kind": "disk",
            "what": "The disk is full: there is no room for the heights.",
            "advice": "Free some space, or point TMPDIR to a larger disk.",
        }
    if job == "write_grid":
        return {
            "kind": "write",
            "what": f"It cannot be written ({cause}).",
            "advice": "Check the free space, the folder and its rights.",
        }
    return {
        "kind": "format",
        "what": f"It cannot be decoded; it is corrupt, cut short or no {kind} ({cause}).",
        "advice": "Copy or export it again.",
    }


if __name__ == "__main__":
    main()
