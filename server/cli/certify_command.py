"""``hedgehop certify``: the clearance certificate of any mission file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from planning.certificate.clearance import certificate_json
from planning.errors import MissionError
from planning.flight_time.predict import predict_duration
from planning.formats.commands import has_position
from planning.formats.detect import read_flight
from planning.formats.other_surface import other_surface
from planning.formats.poi_files import warn_swapped
from planning.margins.words import uncovered_words
from planning.missions.feasibility import Feasibility, feasibility_json, feasibility_of, not_judged
from planning.model import Certificate, Mission, VehicleProfile
from planning.part import Ground, certify_part
from planning.plan import CERTIFICATE_STEP
from planning.report.summary import certificate_summary, dsm_summary
from planning.request import check_hole_area
from planning.terrain.dsm import Dsm, SurfaceModel
from server.cli.shared import options as o
from server.cli.shared.files_in_out import read_small
from server.cli.shared.mission_vehicle import Given, judged_by
from server.cli.shared.output import DONE, FAILED, end_progress, print_json, progress, refusing, say
from server.cli.shared.terrain_given import ModelOptions, open_model
from server.cli.shared.verdict import leg_lines, verdict_lines
from server.work.clocks import StepTimer


def certify(
    dsm: o.DsmFile,
    mission: Annotated[
        Path, typer.Argument(metavar="MISSION", help="Mission: .waypoints, .plan, .kml, .kmz.", show_default=False)
    ],
    as_json: o.AsJson = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show every leg.")] = False,
    crs: o.Crs = None,
    z_scale: o.ZScale = None,
    vertical_datum: o.VerticalDatum = None,
    max_hole_m2: o.MaxHole = 4.0,
    remove_spikes: o.RemoveSpikes = False,
    profile: o.MissionProfile = None,
    position_error_m: o.PositionError = None,
    vehicle_radius_m: o.VehicleRadius = None,
    following_m: o.FollowingError = None,
    dsm_rms_m: o.DsmRms = None,
    downwash_m: o.Downwash = None,
    rtl_height_m: o.RtlHeight = None,
    flown_as: o.MissionFlownAs = None,
    required_clearance_m: o.RequiredClearance = None,
    max_height_above_ground_m: o.MaxHeight = None,
) -> None:
    """Prove the clearance of a mission made anywhere, against your own surface model."""
    with refusing(as_json=as_json):
        check_hole_area(max_hole_m2)
        flight = read_flight(mission.name, read_small(mission))
        given = Given(profile, position_error_m, vehicle_radius_m, following_m, dsm_rms_m, downwash_m, rtl_height_m)
        request = judged_by(flight, given, flown_as, required_clearance_m, max_height_above_ground_m)
        vehicle, params = request.profile, request.clearance()
        timer = StepTimer(progress)
        opened = open_model(dsm, timer, ModelOptions(crs, z_scale, vertical_datum, remove_spikes))
        source = opened.model
        other = other_surface(flight, source)
        if other is not None:
            say(f"Note: {other}")
        uncovered = uncovered_words(params.budget, params.required_clearance_m)
        warnings = [
            *flight.warnings,
            *warn_swapped([i for i in flight.items if has_position(i)], source),
            *([] if uncovered is None else [uncovered]),
        ]
        for warning in warnings:
            say(f"Note: {warning}")
        timer(CERTIFICATE_STEP, None)
        ground, certificate = certify_part(
            source,
            flight,
            params,
            max_hole_m2=max_hole_m2,
            assumptions={**opened.made, "vehicle_profile": vehicle.name},
        )
        opened.say_spikes(ground.dsm)
        feasibility = _feasibility(flight, vehicle, ground.filled, is_named=profile is not None)
        summary = _summary(certificate, flight, vehicle, source, ground)
        summary |= {**feasibility_json(feasibility), "seconds": timer.seconds()}
        end_progress()
        summary = {"other_surface": other, **summary, "warnings": warnings}
        _answer(summary, certificate, as_json=as_json, verbose=verbose)
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


def _summary(
    certificate: Certificate, flight: Mission, vehicle: VehicleProfile, source: SurfaceModel, ground: Ground
) -> dict[str, Any]:
    return {
        **certificate_summary(certificate),
        "rtl_height_m": vehicle.rtl_height_m,
        "items": len(flight.items),
        "dsm": dsm_summary(source, ground.dsm, holes_filled=ground.holes.count),
    }


def _answer(summary: dict[str, Any], certificate: Certificate, *, as_json: bool, verbose: bool) -> None:
    whole = certificate_json(certificate) if verbose else {}
    if as_json:
        print_json(summary | {key: whole[key] for key in ("legs", "assumptions") if key in whole})
        return
    other = [summary["other_surface"]] if summary["other_surface"] is not None else []
    typer.echo("\n".join([*other, *verdict_lines(summary), *leg_lines(whole.get("legs", []))]))
