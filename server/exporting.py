"""Export files, computed from the very document that is exported."""

from __future__ import annotations

import asyncio
import io
import zipfile

from planning.exports import FILES
from server import tasks
from server.clock import utc_now
from server.documents import missing
from server.errors import NotReadyError
from server.jobs import Lane
from server.library import Library
from server.schemas import PlanDoc

ALL = "all.zip"


async def exported(lane: Lane, library: Library, document: PlanDoc, file: str) -> bytes:
    """One file of the plan, or all of them zipped. Raises NotReadyError, PlanningError."""
    hint = missing(document)
    if hint:
        raise NotReadyError("There is no plan to export yet.", advice=hint)
    directory = library.terrain_dir(document.terrain_id or "")
    names = list(FILES) if file == ALL else [file]
    files = await lane.call(tasks.export_plan, directory, document, names, utc_now())
    return await asyncio.to_thread(_zipped, files) if file == ALL else files[file]


def _zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()
