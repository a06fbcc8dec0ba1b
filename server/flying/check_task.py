"""What the flight lane's worker does before a start: judges what was read back, where the vehicle really stands.

The checks bring in the wire protocols; they are imported by the worker only, so that the page answers sooner.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mapping.perceiving.braking import Braking
from planning.basics.plan_model import Mission
from planning.certificate.as_json import certificate_json
from planning.certificate.certificate_model import Certificate, ClearanceParams
from planning.flight_time.return_speeds import ReturnSpeeds
from planning.formats.trajectory_csv import read_trajectory
from planning.formats.wpl import read_wpl, write_wpl
from planning.margins.words import rounded_down, rounded_up
from planning.missions.vehicle_profile import parse_profile
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from server.library.documents import clearance_of, demands_from_doc, places_of, seen_in
from server.library.seen_columns import check_home_stands_on_ground, load_planned_terrain
from server.library.shelf import utc_now
from server.schemas import CheckRow, PlanDoc, PreflightDoc
from server.work.jobs import Progress
from telemetry.flight.avoidance.regions import braking_of
from telemetry.topics.messages import PlanRecord
from telemetry.topics.onboard_lists import Item, OnboardMission, PlacesOnboard
from telemetry.topics.vehicle import VehicleState

if TYPE_CHECKING:
    from telemetry.flight.guided.script_targets import GuidedPlan
    from telemetry.flight.preflight.parameters import Speeds
    from telemetry.flight.preflight.preflight import Preflight


@dataclass(frozen=True, slots=True)
class Moved:
    """The mission with its heights counted from where the vehicle stands."""

    items: tuple[Item, ...]
    record: PlanRecord
    home: tuple[float, float, float]
    """lat_deg, lon_deg, height in the surface model's datum"""
    shift_m: float


@dataclass(frozen=True, slots=True)
class Checked:
    doc: PreflightDoc
    certificate_json: str
    """Of what was read back; empty when there is none."""
    moved: Moved | None
    """What has to be uploaded before the check can be made anew."""
    mission: Mission | None = None
    """What was read back, as it will be flown from where the vehicle stands."""
    clearance: ClearanceParams | None = None
    """What was demanded of it, with the vehicle's own return height."""
    speeds: Speeds | None = None
    """At which the vehicle will fly."""
    braking: Braking = field(default_factory=Braking)
    """That the profile counts on."""
    not_guided: str = ""
    """Why waypoints cannot be handed over one at a time: the line is followed less closely then. Empty: they can."""
    guided_spare_m: float | None = None
    """Clearance beyond what handing them over needs, by which home's height may change meanwhile; None: not judged."""
    at_fence: str = ""
    """What the vehicle does when it crosses its fence; empty: not read."""
    returns: ReturnSpeeds = field(default_factory=ReturnSpeeds)
    """At which the vehicle comes home."""
    fence_kinds_untaken: int = 0
    """As in VehicleState, as they were judged."""
    home_rises_m: float | None = None
    """The vehicle's home above the plan's, whatever was moved since the upload; None: not known."""


def check_start(
    directory: Path,
    record: PlanRecord,
    onboard: OnboardMission,
    state: VehicleState,
    parameters: dict[str, float | None],
    aboard: PlacesOnboard,
    rereferenced_m: float | None = None,
    *,
    report: Progress,
) -> Checked:
    """``rereferenced_m``: by how much the heights of what is on board were moved already."""
    from telemetry.flight.fence_actions import at_fence
    from telemetry.flight.preflight.parameters import flown_speeds, return_speeds
    from telemetry.flight.preflight.preflight import check

    report("Checking the start", None)
    dsm, planned = load_planned_terrain(directory, seen_in(record)), read_wpl(record.mission_wpl)
    if seen_in(record) is not None:
        check_home_stands_on_ground(directory, dsm, (state.home_lat_deg, state.home_lon_deg))
    profile = parse_profile(record.profile_toml.encode(), where="the plan's profile")
    fence, rally = places_of(record)
    found = check(
        onboard,
        state,
        parameters,
        dsm=dsm,
        profile=profile,
        clearance=clearance_of(record),
        planned_home=planned.home,
        firmware=record.firmware,
        rereferenced_m=rereferenced_m,
        fence=fence,
        rally=rally,
        aboard=aboard,
    )
    certificate = "" if found.certificate is None else json.dumps(certificate_json(found.certificate), allow_nan=False)
    moved = _moved(found, record, state, dsm) if found.needs_rereference and rereferenced_m is None else None
    speeds = flown_speeds(parameters, onboard, record.firmware)
    braking = braking_of(record.firmware, profile.brake_decel_m_s2, profile.brake_jerk_m_s3)
    return Checked(
        _doc(found, rereferenced_m),
        certificate,
        moved,
        found.mission,
        found.clearance,
        speeds,
        braking,
        not_guided="" if found.certificate is None else _not_guided(record, found.certificate),
        guided_spare_m=None if found.certificate is None else _guided_spare_m(record, found.certificate),
        at_fence=at_fence(parameters, record.firmware),
        returns=return_speeds(parameters, record.firmware),
        fence_kinds_untaken=state.fence_kinds_untaken,
        home_rises_m=None if found.home_shift_m is None else record.heights_moved_m + found.home_shift_m,
    )


def _not_guided(record: PlanRecord, certificate: Certificate) -> str:
    """Another way of flying is another term for following the line; it is judged from where the vehicle may stand."""
    required_m = _guided_required_m(record)
    if certificate.kept_m >= required_m:
        return ""
    return (
        f"The line keeps {rounded_down(certificate.kept_m)} m; handed over one at a time it needs"
        f" {rounded_up(required_m)} m, because the vehicle follows it less closely."
    )


def _guided_spare_m(record: PlanRecord, certificate: Certificate) -> float:
    """Infinite over nothing that is near."""
    return max(0.0, certificate.kept_m - _guided_required_m(record))


def _guided_required_m(record: PlanRecord) -> float:
    demands = demands_from_doc(PlanDoc.model_validate_json(record.plan_json))
    return replace(demands, way="guided").clearance().required_clearance_m


def guided_targets(record: PlanRecord, *, report: Progress) -> GuidedPlan:
    """The mission as the navigation script hands it over, with the paper's timing. Raises MissionError."""
    from telemetry.flight.guided.script_targets import guided_plan, with_timing

    report("Preparing the navigation script", None)
    plan = guided_plan(read_wpl(record.mission_wpl))
    if not record.path_csv:
        return plan
    return replace(plan, targets=with_timing(plan.targets, read_trajectory(record.path_csv)))


def climb_for_resuming(
    directory: Path,
    mission: Mission,
    clearance: ClearanceParams,
    from_item: int,
    seen_id: str | None,
    *,
    report: Progress,
) -> tuple[int, float]:
    """The item to go on at, and the height above home to fly there at. Raises NotAllowedError."""
    from telemetry.flight.preflight.resume import plan_resumption

    report("Finding the way back into the mission", None)
    surface, _ = fill_holes(load_planned_terrain(directory, seen_id))
    way = plan_resumption(mission, from_item, surface, clearance)
    return way.from_item, way.climb_to_m


def _moved(found: Preflight, record: PlanRecord, state: VehicleState, dsm: Dsm) -> Moved | None:
    from telemetry.flight.preflight.preflight import actual_home
    from telemetry.flight.preflight.rereference import rereference
    from telemetry.mavlink.items import items_from_mission

    home, shift_m = actual_home(state, dsm), found.home_shift_m
    if home is None or shift_m is None or not math.isfinite(home.alt_dsm_m):
        return None
    mission = rereference(read_wpl(record.mission_wpl), shift_m, home=home)
    text = write_wpl(mission)
    written = read_wpl(text)
    return Moved(
        items=items_from_mission(written),
        record=replace(
            record,
            mission_wpl=text,
            digest="",
            certificate_json="",
            home_alt_dsm_m=home.alt_dsm_m,
            heights_moved_m=record.heights_moved_m + shift_m,
        ),
        home=(home.lat_deg, home.lon_deg, home.alt_dsm_m),
        shift_m=shift_m,
    )


def _doc(found: Preflight, rereferenced_m: float | None) -> PreflightDoc:
    nearest_m = found.min_distance_m
    return PreflightDoc(
        ok=found.ok({row.code for row in found.rows}),
        rows=[CheckRow(code=row.code, state=row.state, text=row.text, mend=row.mend) for row in found.rows],
        home_shift_m=found.home_shift_m if rereferenced_m is None else rereferenced_m,
        rereferenced=rereferenced_m is not None,
        min_distance_m=None if nearest_m is None or not np.isfinite(nearest_m) else nearest_m,
        checked_utc=utc_now(),
    )
