"""The surface model that a plan's points were planned on, where that is another one than the plan's own."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planning.basics.plan_model import Home, Mission
from planning.formats.other_surface import other_surface, surface_digest
from planning.formats.safe_text import clean_name
from planning.terrain.dsm import SurfaceModel
from server.schemas import PlanDoc, PlannedOnDoc, TerrainDoc


def planned_on(mission: Mission | None) -> PlannedOnDoc | None:
    """What a mission's file says of the surface model that it was planned on."""
    if mission is None or not mission.surface_sha256:
        return None
    home = mission.home
    known = all(math.isfinite(value) for value in (home.lat_deg, home.lon_deg, home.alt_dsm_m))
    place = {"home_lat_deg": home.lat_deg, "home_lon_deg": home.lon_deg, "home_alt_dsm_m": home.alt_dsm_m}
    return PlannedOnDoc(name=mission.surface_name, sha256=mission.surface_sha256, **(place if known else {}))


def other_model(document: PlanDoc, dsm: SurfaceModel) -> str:
    """That the plan's points come from another surface model than ``dsm``, in words; empty when they do not."""
    planned = document.planned_on
    if planned is None or planned.sha256 == dsm.sha256:
        return ""
    places = (planned.home_lat_deg, planned.home_lon_deg, planned.home_alt_dsm_m)
    lat_deg, lon_deg, alt_m = (math.nan if value is None else value for value in places)
    home = Home(lat_deg, lon_deg, alt_m)
    return other_surface(Mission(home, (), surface_sha256=planned.sha256, surface_name=planned.name), dsm) or ""


def on_another_model(before: PlanDoc, after: PlanDoc, terrains: Sequence[TerrainDoc]) -> PlanDoc:
    """Remembers the model of before when a plan with points is given another one; its first one stays remembered."""
    has_places = bool(after.pois or after.survey.polygon)
    changed = before.terrain_id is not None and after.terrain_id not in (None, before.terrain_id)
    if not changed or not has_places or after.planned_on is not None:
        return after
    known = {terrain.id: terrain for terrain in terrains}
    old, new = known.get(before.terrain_id or ""), known.get(after.terrain_id or "")
    if old is None or new is None or not surface_digest(old.sha256) or old.sha256 == new.sha256:
        return after
    return after.model_copy(update={"planned_on": PlannedOnDoc(name=clean_name(old.name), sha256=old.sha256)})
