"""The demo: a generated surface model and a plan over it, made once and opened again."""

from __future__ import annotations

import asyncio

from planning.ground.demo_hillside import demo_pois, demo_survey_polygon
from planning.missions.vehicle_profile import load_profile
from server.library import Library
from server.library.documents import doc_from_profile
from server.library.history import History
from server.library.whole_files import new_id
from server.plan import file_tasks
from server.schemas import PlaceDoc, PlanDoc, PoiDoc, SurfaceDoc, SurveyDoc, TerrainDoc
from server.work.jobs import Lane, Progress

TERRAIN_NAME = "Demo hillside (generated)"
PLAN_NAME = "Demo flight"
_NOTE = "demo-plan"
_RTL_HEIGHT_M = 60.0
_HEIGHT_M = 5.5
"""High enough for both ways of flying: handed over one at a time, waypoints are followed less closely."""


def terrain(library: Library) -> TerrainDoc | None:
    """The demo's surface model, if it has been made."""
    return next((doc for doc in library.terrains() if doc.name == TERRAIN_NAME), None)


async def ensure_terrain(library: Library, lane: Lane, progress: Progress) -> None:
    """Makes the surface model unless it is there: the board runs one such job after the other."""
    if terrain(library) is None:
        await lane.call(file_tasks.make_demo_terrain, library.root, TERRAIN_NAME, progress=progress)
        await asyncio.to_thread(library.refresh)


def ensure_plan(library: Library, model: TerrainDoc) -> str:
    """The id of the demo's plan, made if it is missing."""
    plan_id = library.read_note(_NOTE)
    if plan_id is None or plan_id not in {entry.id for entry in library.plans()}:
        plan_id, _ = library.create_plan(History([_document(model)]))
        library.write_note(_NOTE, plan_id)
    return plan_id


def _document(terrain: TerrainDoc) -> PlanDoc:
    profile = doc_from_profile(load_profile("generic-quad"))
    return PlanDoc(
        name=PLAN_NAME,
        terrain_id=terrain.id,
        pois=[
            PoiDoc(id=new_id(), lat_deg=p.lat_deg, lon_deg=p.lon_deg, name=p.name, loiter_s=p.loiter_s)
            for p in demo_pois()
        ],
        survey=SurveyDoc(polygon=[PlaceDoc(lat_deg=lat, lon_deg=lon) for lat, lon in demo_survey_polygon().tolist()]),
        profile=profile.model_copy(update={"rtl_height_m": _RTL_HEIGHT_M}),
        surface=SurfaceDoc(height_m=_HEIGHT_M),
    )
