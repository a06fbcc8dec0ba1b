"""Obstacles: alerts acknowledged, avoidance, what is searched, manoeuvres, and maps as files or in the plan."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query
from fastapi.responses import Response

from server.api.access import DONE, ERROR_RESPONSES, Fly, InCharge, answer
from server.schemas import (
    AcknowledgeBody,
    MapFormat,
    ObstaclesState,
    PerceptionSettingsBody,
    PlanState,
    PlanWithSeen,
    RadarTargetsDoc,
    SectionAsked,
    SectionDoc,
    SetAvoidanceBody,
    Source,
)
from telemetry.topics.obstacles import MapName

router = APIRouter(prefix="/api/obstacles", tags=["obstacles"], responses=ERROR_RESPONSES)

MEDIA_TYPES: dict[MapFormat, str] = {
    "ply": "application/octet-stream",
    "pcd": "application/octet-stream",
    "bt": "application/octet-stream",
    "mcap": "application/octet-stream",
    "tif": "image/tiff",
    "geojson": "application/geo+json",
}


@router.post("/acknowledge", response_model=ObstaclesState)
async def acknowledge(body: AcknowledgeBody, operator: InCharge, flying: Fly) -> Response:
    """One alert, or all: it stays latched until it is over as well."""
    del operator
    return answer(await flying.obstacles.acknowledge(body.alert_id))


@router.put("/avoidance", **DONE)
async def set_avoidance(body: SetAvoidanceBody, operator: InCharge, flying: Fly) -> None:
    """409 without consent, unless the vehicle is a simulation; what came of it is told by the stream."""
    await flying.obstacles.set_avoidance(operator, body)


@router.put("/settings", response_model=ObstaclesState)
async def change_settings(body: PerceptionSettingsBody, operator: InCharge, flying: Fly) -> Response:
    """Regions, the vehicle that they are for, the maps' voxels and memory; 422 for what cannot fit.

    What is left out stays. Other voxels or another memory limit begin a map anew.
    """
    del operator
    return answer(await flying.obstacles.change_settings(body))


@router.post("/clear", **DONE)
async def clear(operator: InCharge, flying: Fly) -> None:
    """Empties all maps."""
    del operator
    await flying.obstacles.clear()


@router.post("/manoeuvre/{manoeuvre_id}/fly", **DONE)
async def fly_manoeuvre(manoeuvre_id: Annotated[str, Path(max_length=100)], operator: InCharge, flying: Fly) -> None:
    """404 for one that is out of date."""
    await flying.obstacles.fly(operator, manoeuvre_id)


@router.put("/seen", response_model=PlanState)
async def plan_with_seen(body: PlanWithSeen, operator: InCharge, flying: Fly) -> Response:
    """Takes what was seen into the open plan's surface model, or out of it again; an edit that can be undone."""
    del operator
    return answer(await flying.obstacles.plan_with_seen(body))


@router.get("/section", response_model=SectionDoc)
async def section(flying: Fly, asked: Annotated[SectionAsked, Query()]) -> Response:
    """A vertical slice through the maps where the vehicle is, or was at the replay's time."""
    return answer(await flying.looking.section(asked))


@router.get("/targets", response_model=RadarTargetsDoc)
async def targets(flying: Fly, source: Annotated[Source, Query()] = "live") -> Response:
    """All targets of the radar's newest frame, kept by its gate or not."""
    return answer(await flying.looking.targets(source))


@router.get("/map/{name}.{kind}", response_class=Response)
async def export_map(
    name: MapName, kind: MapFormat, flying: Fly, source: Annotated[Source, Query()] = "live"
) -> Response:
    """A map as it is now: points, OctoMap, its ROS 2 message, highest obstacle per cell, or clusters; 409 while empty.

    "vision_flight": of all that the camera has seen on its way.
    """
    data = await flying.obstacles.exported(source, name, kind)
    headers = {"content-disposition": f'attachment; filename="{name.replace("_", "-")}-map.{kind}"'}
    return Response(data, media_type=MEDIA_TYPES[kind], headers=headers)
