"""Surface models and orthophotos: raw bytes in, jobs that read them, deletion."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from server.api.access import DONE, ERROR_RESPONSES, Work, answer, parts_of
from server.door.uploads import display_folder, display_name, stream_to_disk, suffix_of
from server.errors import BadRequestError
from server.library.terrain_picture import terrain_picture_png
from server.library.terrains import Origin
from server.schemas import JobDoc, TerrainDoc

router = APIRouter(prefix="/api", tags=["terrain"], responses=ERROR_RESPONSES)

FileName = Annotated[str, Query(max_length=1000)]
Declared = Annotated[str, Query(max_length=10_000)]
Number = Annotated[str, Query(max_length=20, pattern=r"^[0-9.eE+-]*$")]
RAW_BODY: dict[str, Any] = {"requestBody": {"content": {"application/octet-stream": {}}, "required": True}}


@router.post("/terrains", response_model=JobDoc, status_code=202, openapi_extra=RAW_BODY)
async def add_terrain(
    request: Request,
    workspace: Work,
    filename: FileName,
    crs: Declared = "",
    z_scale: Number = "",
    vertical_datum: Declared = "",
    remove_spikes: bool = False,
    cell_m: Number = "",
    keep_noise: bool = False,
    folder: Annotated[str, Query(max_length=1000)] = "",
    file_utc: Annotated[datetime | None, Query()] = None,
) -> Response:
    """A GeoTIFF, an ESRI ASCII grid, a ZIP of tiles or of a mapping project, a point cloud, or a textured
    mesh (.glb, .gltf, a ZIP of 3D Tiles), told by the content.

    A mesh is drawn in place of the surface model that is on show: a picture, by which nothing is judged.

    What the file does not say can be declared; empty: nothing is. ``cell_m`` and ``keep_noise`` are for clouds.
    """
    scale = _positive(z_scale, "z_scale", "metres per stored unit, such as 0.01")
    cells = _positive(cell_m, "cell_m", "metres, such as 0.25")
    name = display_name(filename)
    upload = await stream_to_disk(request, parts_of(request).library.new_upload(suffix_of(name)))
    job = workspace.files.add_terrain(
        upload,
        name,
        origin=Origin(display_folder(folder), file_utc and file_utc.astimezone(UTC).isoformat(timespec="seconds")),
        crs=crs.strip() or None,
        z_scale=scale,
        vertical_datum=vertical_datum.strip() or None,
        remove_spikes=remove_spikes,
        cell_m=cells,
        keep_noise=keep_noise,
    )
    return answer(job, 202)


@router.get("/terrains/{terrain_id}/picture.png", response_class=Response)
async def terrain_picture(terrain_id: str, request: Request) -> Response:
    """The surface model's relief, small enough for a list."""
    folder = parts_of(request).library.terrain_dir(terrain_id)
    png = await asyncio.to_thread(terrain_picture_png, folder)
    return Response(png, media_type="image/png", headers={"Cache-Control": "private, max-age=86400, immutable"})


@router.post("/terrains/demo", response_model=TerrainDoc)
async def add_demo_terrain(workspace: Work) -> Response:
    """The generated demo model; opens the demo plan."""
    return answer(await workspace.terrains.add_demo())


@router.post("/terrains/{terrain_id}/remove_spikes", response_model=JobDoc, status_code=202)
async def remove_spikes(terrain_id: str, workspace: Work) -> Response:
    """Makes a new surface model without the isolated spikes and pits of this one."""
    return answer(workspace.files.remove_spikes(terrain_id), 202)


@router.delete("/terrains/{terrain_id}", **DONE)
async def delete_terrain(terrain_id: str, workspace: Work) -> None:
    """409 while a plan uses it."""
    await workspace.terrains.delete(terrain_id)


@router.post("/orthophotos", response_model=JobDoc, status_code=202, openapi_extra=RAW_BODY)
async def add_orthophoto(
    request: Request, workspace: Work, filename: FileName, terrain_id: Annotated[str, Query(max_length=32)]
) -> Response:
    """An orthomosaic GeoTIFF, draped on a surface model."""
    library = parts_of(request).library
    library.terrain_dir(terrain_id)
    name = display_name(filename)
    upload = await stream_to_disk(request, library.new_upload(suffix_of(name)))
    return answer(workspace.files.add_orthophoto(upload, name, terrain_id), 202)


@router.delete("/meshes/{mesh_id}", **DONE)
async def delete_mesh(mesh_id: str, workspace: Work) -> None:
    """A textured mesh alone; its surface model stays."""
    await workspace.files.delete_mesh(mesh_id)


@router.post("/jobs/{job_id}/cancel", status_code=204)
async def cancel_job(job_id: str, workspace: Work) -> Response:
    workspace.board.cancel(job_id)
    return Response(status_code=204)


def _positive(text: str, where: str, such: str) -> float | None:
    """A number; the reader itself refuses what makes no sense as one."""
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        raise BadRequestError(f"{text!r} is no number.", where=where, advice=f"Give {such}.") from None
