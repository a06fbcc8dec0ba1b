"""What the plan lane's worker makes for an upload: the mission exactly as it is exported, and its record."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from planning.formats import trajectory_csv, wpl
from planning.missions.vehicle_profile import dump_profile
from planning.planner.request import effective_profile
from server.library.documents import places_of
from server.plan.tasks import last_plan
from server.schemas import PlanDoc
from server.work.jobs import Progress
from telemetry.topics.messages import PlanRecord
from telemetry.topics.onboard_lists import Item, PlaceList


@dataclass(frozen=True, slots=True)
class MadeUpload:
    items: tuple[Item, ...]
    record: PlanRecord
    """Its digest is still empty: the vehicle's read-back gives it."""
    home_lat_deg: float
    home_lon_deg: float
    home_alt_m: float
    """Above the surface model's datum; ArduPilot puts its own in its place."""
    places: dict[PlaceList, tuple[Item, ...]]
    """Fence and rally points."""
    places_before: dict[PlaceList, tuple[Item, ...]]
    """Those of the plan that was uploaded before."""


def make_upload(
    directory: Path, document: PlanDoc, terrain_name: str, before: PlanRecord | None, *, report: Progress
) -> MadeUpload:
    """The plan is the one that was computed last, or is computed again; ``before``: what was uploaded before it."""
    from telemetry.flight.preflight.fence_check import NOTHING, sent_places
    from telemetry.mavlink.items import items_from_mission

    plan, source, _ = last_plan.of(directory, document, report)
    report("Preparing the mission", None)
    text = wpl.write_wpl(plan.mission)
    mission = wpl.read_wpl(text)
    profile = effective_profile(plan.request.profile, plan.request.path)
    record = PlanRecord(
        t_utc_s=time.time(),
        name=document.name,
        mission_wpl=text,
        digest="",
        firmware=mission.firmware,
        terrain_id=document.terrain_id or "",
        terrain_name=terrain_name,
        terrain_sha256=source.sha256,
        home_alt_dsm_m=plan.line.home_alt_dsm_m,
        vertical_datum=source.vertical_datum,
        profile_toml=dump_profile(profile),
        certificate_json="",
        plan_json=document.model_dump_json(),
        path_csv=trajectory_csv.write_trajectory(plan.path, plan.timing, plan.mission.home, plan.dsm),
    )
    home = mission.home
    replaced = NOTHING if before is None else places_of(before)
    return MadeUpload(
        items_from_mission(mission),
        record,
        home.lat_deg,
        home.lon_deg,
        home.alt_dsm_m,
        sent_places((plan.request.fence, plan.request.rally), mission.firmware),
        sent_places(replaced, mission.firmware),
    )
