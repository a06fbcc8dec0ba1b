"""The open plan: edits, undo, files in and out."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from planning.report.exports import FileName
from server.api.access import DONE, ERROR_RESPONSES, Work, answer, parts_of
from server.door.uploads import display_name, stream_to_disk, suffix_of
from server.schemas import Imported, OpenPlan, PlanEdit, PlanState, SavePlanAs, Snapshot

router = APIRouter(prefix="/api", tags=["plan"], responses=ERROR_RESPONSES)

FenceFileName = Literal["fence.plan", "fence.waypoints", "rally.waypoints", "fence.kml", "fence.geojson"]
ExportFile = Literal[FileName, "all.zip"]
MEDIA_TYPES = {
    "csv": "text/csv; charset=utf-8",
    "kml": "application/vnd.google-earth.kml+xml",
    "waypoints": "text/plain; charset=utf-8",
    "plan": "application/json",
    "geojson": "application/geo+json",
    "json": "application/json",
    "html": "text/html; charset=utf-8",
    "zip": "application/zip",
}
# The report is one file of styles and pictures; names from files that slipped an escape still run nothing.
REPORT_POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; font-src data:; frame-ancestors 'self'; "
    "base-uri 'none'; form-action 'none'"
)


@router.get("/state", response_model=Snapshot)
async def state(workspace: Work) -> Response:
    """Everything a page shows, once; ``/ws`` tells what changes."""
    return answer(workspace.snapshot(""))


@router.put("/plan", response_model=PlanState)
async def edit(edit: PlanEdit, workspace: Work) -> Response:
    """Replaces the document; 409 when it has changed since ``base_revision``."""
    return answer(await workspace.plans.edit(edit))


@router.post("/plan/undo", response_model=PlanState)
async def undo(workspace: Work) -> Response:
    return answer(await workspace.plans.undo())


@router.post("/plan/redo", response_model=PlanState)
async def redo(workspace: Work) -> Response:
    return answer(await workspace.plans.redo())


@router.post("/plan/new", response_model=PlanState)
async def new(workspace: Work) -> Response:
    return answer(await workspace.plans.new())


@router.post("/plan/open", response_model=PlanState)
async def open_plan(body: OpenPlan, workspace: Work) -> Response:
    return answer(await workspace.plans.open(body.plan_id))


@router.post("/plan/save_as", response_model=PlanState)
async def save_as(body: SavePlanAs, workspace: Work) -> Response:
    """A copy under another name, which is then the open plan."""
    return answer(await workspace.plans.save_as(body.name))


@router.delete("/plans/{plan_id}", **DONE)
async def delete(plan_id: str, workspace: Work) -> None:
    await workspace.plans.delete(plan_id)


@router.post(
    "/plan/import",
    response_model=Imported,
    openapi_extra={"requestBody": {"content": {"application/octet-stream": {}}, "required": True}},
)
async def import_points(
    request: Request, workspace: Work, filename: Annotated[str, Query(max_length=1000)], only_fence: bool = False
) -> Response:
    """Points, a polygon or a fence from the raw bytes of a CSV, GeoJSON, KML, .waypoints or .plan file."""
    name = display_name(filename)
    upload = await stream_to_disk(request, parts_of(request).library.new_upload(suffix_of(name)))
    return answer(await workspace.plans.import_points(name, upload, only_fence=only_fence))


@router.get("/plan/fence/{file}", response_class=Response)
async def export_fence(file: FenceFileName, workspace: Work) -> Response:
    """Fence and rally points of the open plan, certified or not."""
    data = await workspace.plans.exported_fence(file)
    headers = {"content-disposition": f'attachment; filename="{file}"'}
    return Response(data, media_type=MEDIA_TYPES[file.rpartition(".")[2]], headers=headers)


@router.post("/plan/shortest_order", response_model=PlanState)
async def shortest_order(workspace: Work) -> Response:
    return answer(await workspace.plans.shortest_order())


@router.get("/plan/export/{file}", response_class=Response)
async def export(file: ExportFile, workspace: Work, inline: bool = False) -> Response:
    """One file of the finished plan, or all of them; 409 while there is none."""
    data = await workspace.plans.export(file)
    shown = inline and file == "report.html"
    headers = {"content-disposition": f'{"inline" if shown else "attachment"}; filename="{file}"'}
    if file.endswith(".html"):
        headers["content-security-policy"] = REPORT_POLICY
    return Response(data, media_type=MEDIA_TYPES[file.rpartition(".")[2]], headers=headers)
