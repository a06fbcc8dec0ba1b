"""What ``plan`` and ``survey`` share: what is asked for, reading, planning, writing, answering."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from planning.basics.plan_model import MissionParams, SurfaceParams, VehicleProfile
from planning.missions.vehicle_profile import load_profile, path_params
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest, check_request
from planning.report.exports import FILES, export_file
from planning.report.summary import plan_summary
from planning.report.words import duration, metres
from planning.terrain.dsm import SurfaceModel
from server.cli.shared.command import DONE, FAILED
from server.cli.shared.files_in_out import check_directory, write_files
from server.cli.shared.options import ModelOptions, PlanOptions, of_vehicle, parse_place
from server.cli.shared.output import answer, end_progress, harmless, progress, say_notes
from server.cli.shared.terrain_given import open_model
from server.cli.shared.verdict import verdict_lines
from server.library.shelf import utc_now
from server.work.clocks import StepTimer


def vehicle_of(options: PlanOptions) -> VehicleProfile:
    """The named profile with the options that were given."""
    given = of_vehicle(options.path, options.vehicle, options.clearance)
    return replace(load_profile(options.vehicle.profile), **given)


def request_of(options: PlanOptions, vehicle: VehicleProfile, **mission: Any) -> PlanRequest:
    """All but the points; ``mission`` are fields of ``MissionParams``. Raises ParameterError for what cannot be."""
    surface, path, clearance = options.surface, options.path, options.clearance
    request = PlanRequest(
        pois=(),
        profile=vehicle,
        surface=SurfaceParams(
            surface.radius_m,
            surface.height_m,
            surface.smooth_m,
            floor=not surface.paper,
            fill_hole_area_m2=options.model.max_hole_m2,
        ),
        path=replace(path_params(vehicle), step_m=path.step_m, on_steep=path.on_steep),
        mission=MissionParams(
            max_items=vehicle.max_items,
            excess_height_m=options.mission.excess_height_m,
            end=options.mission.end,
            altitude_reference=options.mission.altitude_reference,
            **mission,
        ),
        home_lat_lon_deg=parse_place(options.mission.home, "--home"),
        required_clearance_m=clearance.required_clearance_m,
        max_height_above_ground_m=clearance.max_height_above_ground_m,
        way=clearance.flown_as,
    )
    check_request(request)
    return request


def run(
    dsm_file: Path,
    out: Path,
    request_for: Callable[[SurfaceModel], PlanRequest],
    *,
    title: str,
    as_json: bool,
    model: ModelOptions,
) -> None:
    """Plans, writes every file, says what came of it, and ends with 0 (certified and feasible) or 1."""
    check_directory(out)
    timer = StepTimer(progress)
    opened = open_model(dsm_file, timer, model)
    source = opened.model
    plan = plan_mission(source, request_for(source), report=timer, assumptions=opened.made)
    seconds = timer.seconds()
    opened.say_part(plan.ground)
    progress("Writing the files", None)
    created_utc = utc_now()
    files = {
        name: export_file(name, plan, source, title=title, created_utc=created_utc, seconds=seconds) for name in FILES
    }
    write_files(out, files)
    end_progress()
    say_notes(*plan.warnings)
    summary = {**plan_summary(plan, source), "seconds": seconds}
    answer(summary, _lines(summary, out), as_json=as_json)
    raise typer.Exit(DONE if plan.certificate.certified and plan.feasibility.feasible else FAILED)


def _lines(summary: dict[str, Any], out: Path) -> list[str]:
    return [
        *verdict_lines(summary),
        f"  {metres(summary['length_m'], 0)} long, {duration(summary['duration_s'])} of the "
        f"{duration(summary['usable_endurance_s'])} the battery gives, "
        f"{summary['items']} of {summary['max_items']} items ({summary['waypoints']} waypoints)",
        f"Written to {harmless(str(out))}: {', '.join(FILES)}",
    ]
