"""Traversability: worked out for the open surface model, cleared of foliage by a radar log, searched for landing sites.

Nothing here reaches a vehicle: like the rest of planning it needs nobody to be in charge.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response
from pydantic import Field

from server.api.access import DONE, ERROR_RESPONSES, All, Work, answer, parts_of
from server.api.terrain_routes import RAW_BODY
from server.door.uploads import display_name, stream_to_disk, suffix_of
from server.schemas import JobDoc, LandingSitesBody, LayerName, TraversabilityBody, TraversabilityState, UwbRule


class UwbClear(UwbRule):
    """Of a radar log that is sent."""

    name: Annotated[str, Field(max_length=1000)]


router = APIRouter(prefix="/api/traversability", tags=["traversability"], responses=ERROR_RESPONSES)


@router.post("", response_model=JobDoc, status_code=202)
async def work_out(body: TraversabilityBody, workspace: Work) -> Response:
    """Slope, roughness and index of the open surface model; what came of it is told by the stream."""
    return answer(workspace.traversability.work_out(body), 202)


@router.post("/uwb", response_model=JobDoc, status_code=202, openapi_extra=RAW_BODY)
async def clear_foliage(request: Request, workspace: Work, asked: Annotated[UwbClear, Query()]) -> Response:
    """A UWB radar log as raw bytes: what it shows to be foliage is cleared."""
    params, shown = asked.params(), display_name(asked.name)
    upload = await stream_to_disk(request, parts_of(request).library.new_upload(suffix_of(shown)))
    return answer(workspace.traversability.clear_foliage(upload, shown, params), 202)


@router.put("/uwb/live", response_model=TraversabilityState)
async def fuse_live(workspace: Work, fleet: All, asked: Annotated[UwbRule, Query()]) -> Response:
    """How the scans of a radar that scans now are fused, those before as well."""
    fleet.uwb.set_params(asked.params())
    return answer(workspace.traversability.state)


@router.post("/sites", response_model=TraversabilityState)
async def landing_sites(body: LandingSitesBody, workspace: Work) -> Response:
    """The five best places near a point, from the map before clearing; 409 before there is one."""
    return answer(await workspace.traversability.sites(body))


@router.get("/map/{layer}.tif", response_class=Response)
async def export_layer(layer: LayerName, workspace: Work) -> Response:
    """A layer as GeoTIFF; 409 before there is one."""
    data = await workspace.traversability.layer_file(layer)
    headers = {"content-disposition": f'attachment; filename="traversability-{layer}.tif"'}
    return Response(data, media_type="image/tiff", headers=headers)


@router.delete("", **DONE)
async def forget(workspace: Work, fleet: All) -> None:
    """Forgets the maps, and live scans; what is being worked out is cancelled."""
    workspace.traversability.forget()
    fleet.uwb.clear()
