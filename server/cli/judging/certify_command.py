"""``hedgehop certify``: the clearance certificate of any mission file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from planning.basics import limits
from planning.basics.plan_model import Mission, VehicleProfile
from planning.certificate.clearance import certificate_json
from planning.errors import MissionError
from planning.flight_time.predict import predict_duration
from planning.formats.commands import has_position
from planning.formats.detect import read_flight
from planning.formats.other_surface import other_surface
from planning.formats.poi_files import warn_swapped
from planning.margins.words import uncovered_words
from planning.missions.feasibility import Feasibility, feasibility_json, feasibility_of, not_judged
from planning.planner.part import certify_part, looked_over, mission_places
from planning.planner.plan import CERTIFICATE_STEP
from planning.report.summary import certificate_summary, dsm_summary
from planning.terrain.dsm import Dsm
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, Without, command
from server.cli.shared.fence_given import fence_given
from server.cli.shared.files_in_out import read_small
from server.cli.shared.mission_vehicle import judged_by
from server.cli.shared.output import answer, end_progress, progress, say_notes
from server.cli.shared.terrain_given import open_model
from server.cli.shared.verdict import leg_lines, verdict_lines
from server.work.clocks import StepTimer


@command
def certify(
    dsm: o.DsmFile,
    mission: Annotated[Path, Argument(metavar="MISSION", help="Mission: .waypoints, .plan, .kml, .kmz.")],
    *,
    as_json: o.AsJson = False,
    verbose: Annotated[bool, Option("--verbose", "-v", help="Show every leg.")] = False,
    model: o.ModelOptions,
    given: Annotated[o.VehicleOptions, Without("max_items")],
    demands: o.ClearanceOptions,
    keep_to: o.FenceOptions,
) -> None:
    """Prove the clearance of a mission made anywhere, against your own surface model."""
    limits.SURFACE["fill_hole_area_m2"].check(model.max_hole_m2)
    flight = read_flight(mission.name, read_small(mission))
    fence, rally = fence_given(keep_to.fence, flight)
    flight = replace(flight, fence=fence, rally=rally)
    request = judged_by(flight, given, demands, demands.flown_as)
    vehicle = request.profile
    timer = StepTimer(progress)
    opened = open_model(dsm, timer, model)
    demanded_m = request.clearance().required_clearance_m
    source = looked_over(opened.model, mission_places(opened.model, flight), demanded_m)
    params = request.clearance_over(source)
    other = other_surface(flight, source)
    uncovered = uncovered_words(params.budget, params.required_clearance_m)
    warnings = [
        *flight.warnings,
        *warn_swapped([i for i in flight.items if has_position(i)], source),
        *([] if uncovered is None else [uncovered]),
    ]
    say_notes(other, *warnings)
    timer(CERTIFICATE_STEP, None)
    ground, certificate = certify_part(
        source,
        flight,
        request.clearance(),
        max_hole_m2=model.max_hole_m2,
        assumptions={**opened.made, "vehicle_profile": vehicle.name},
    )
    opened.say_part(ground.dsm)
    feasibility = _feasibility(flight, vehicle, ground.filled, is_named=given.profile is not None)
    whole = certificate_json(certificate) if verbose else {}
    summary = {
        "other_surface": other,
        **certificate_summary(certificate),
        "rtl_height_m": vehicle.rtl_height_m,
        "items": len(flight.items),
        "dsm": dsm_summary(source, ground.dsm, holes_filled=ground.holes.count),
        **feasibility_json(feasibility),
        "seconds": timer.seconds(),
        "warnings": warnings,
        **{key: whole[key] for key in ("legs", "assumptions") if key in whole},
    }
    end_progress()
    lines = [*([] if other is None else [other]), *verdict_lines(summary), *leg_lines(whole.get("legs", []))]
    answer(summary, lines, as_json=as_json)
    raise typer.Exit(DONE if certificate.certified and feasibility.feasible is not False else FAILED)


def _feasibility(flight: Mission, vehicle: VehicleProfile, dsm: Dsm, *, is_named: bool) -> Feasibility:
    """Of a mission made anywhere, as far as its vehicle is known: by its own file, or by --profile."""
    if flight.planned_for is None and not is_named:
        return not_judged("The mission's file names no vehicle: whether one can fly it is not judged.")
    try:
        predicted_s = predict_duration(flight, vehicle, dsm).total_s
    except MissionError:
        predicted_s = None
    return feasibility_of(flight, vehicle, predicted_s)
