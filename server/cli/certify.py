"""``hedgehop certify``: the clearance certificate of any mission file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from planning.clearance import certificate_json
from planning.clearance import certify as certify_line
from planning.dsm import Dsm
from planning.flown import flown_line
from planning.formats.commands import has_position
from planning.formats.detect import read_flight
from planning.holes import HoleReport, fill_holes
from planning.home import home_on_ground
from planning.model import Certificate, ClearanceParams, Mission, VehicleProfile
from planning.plan import CERTIFICATE_STEP, hole_assumptions
from planning.poi_files import warn_swapped
from planning.request import PlanRequest, check_demands, check_hole_area
from planning.summary import certificate_summary, dsm_summary
from server.cli import options as o
from server.cli.files import read_small
from server.cli.output import DONE, FAILED, end_progress, print_json, progress, refusing, say
from server.cli.planning_run import profile_with
from server.cli.terrain import ModelOptions, read_model
from server.cli.verdict import leg_lines, verdict_lines
from server.stopwatch import StepTimer


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
    profile: o.Profile = "generic-quad",
    position_error_m: o.PositionError = None,
    rtl_height_m: o.RtlHeight = None,
    required_clearance_m: o.RequiredClearance = None,
    max_height_above_ground_m: o.MaxHeight = None,
) -> None:
    """Prove the clearance of a mission made anywhere, against your own surface model."""
    with refusing(as_json=as_json):
        vehicle = profile_with(profile, position_error_m=position_error_m, rtl_height_m=rtl_height_m)
        check_hole_area(max_hole_m2)
        params = _demands(vehicle, required_clearance_m, max_height_above_ground_m)
        flight = read_flight(mission.name, read_small(mission))
        timer = StepTimer(progress)
        source, made = read_model(dsm, timer, ModelOptions(crs, z_scale, vertical_datum, remove_spikes))
        warnings = [*flight.warnings, *warn_swapped([i for i in flight.items if has_position(i)], source)]
        for warning in warnings:
            say(f"Note: {warning}")
        timer(CERTIFICATE_STEP, None)
        filled, holes = fill_holes(source, max_area_m2=max_hole_m2)
        made |= {**hole_assumptions(holes, max_hole_m2), "vehicle_profile": vehicle.name}
        certificate = certify_line(filled, home_on_ground(flown_line(flight, filled), source), params, assumptions=made)
        summary = _summary(certificate, flight, vehicle, source, holes) | {"seconds": timer.seconds()}
        end_progress()
        _answer(summary | {"warnings": warnings}, certificate, as_json=as_json, verbose=verbose)
        raise typer.Exit(DONE if certificate.certified else FAILED)


def _demands(vehicle: VehicleProfile, required_m: float | None, max_height_m: float | None) -> ClearanceParams:
    request = PlanRequest(
        pois=(), profile=vehicle, required_clearance_m=required_m, max_height_above_ground_m=max_height_m
    )
    check_demands(request)
    return request.clearance()


def _summary(
    certificate: Certificate, flight: Mission, vehicle: VehicleProfile, source: Dsm, holes: HoleReport
) -> dict[str, Any]:
    return {
        **certificate_summary(certificate),
        "rtl_height_m": vehicle.rtl_height_m,
        "items": len(flight.items),
        "dsm": dsm_summary(source, holes_filled=holes.count),
    }


def _answer(summary: dict[str, Any], certificate: Certificate, *, as_json: bool, verbose: bool) -> None:
    whole = certificate_json(certificate) if verbose else {}
    if as_json:
        print_json(summary | {key: whole[key] for key in ("legs", "assumptions") if key in whole})
        return
    typer.echo("\n".join([*verdict_lines(summary), *leg_lines(whole.get("legs", []))]))
