"""``hedgehop certify``: the clearance certificate of any mission file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planning.clearance import certify as certify_line
from planning.flown import flown_line
from planning.formats.detect import read_mission
from planning.holes import fill_holes
from planning.model import SurfaceParams, VehicleProfile
from planning.plan import CERTIFICATE_STEP
from planning.request import PlanRequest
from planning.summary import certificate_summary, dsm_summary
from server.cli import options as o
from server.cli.output import DONE, FAILED, end_progress, print_json, progress, refusing, say, verdict_lines
from server.cli.planning_run import profile_with, read_model
from server.stopwatch import StepTimer


def certify(
    dsm: o.DsmFile,
    mission: Annotated[Path, typer.Argument(help="Mission: .waypoints or .plan.", show_default=False)],
    profile: o.Profile = "generic-quad",
    position_error_m: o.PositionError = None,
    required_clearance_m: o.RequiredClearance = None,
    rtl_height_m: o.RtlHeight = None,
    max_height_above_ground_m: o.MaxHeight = None,
    crs: o.Crs = None,
    z_scale: o.ZScale = None,
    vertical_datum: o.VerticalDatum = None,
    as_json: o.AsJson = False,
) -> None:
    """Prove the clearance of a mission made anywhere, against your own surface model."""
    with refusing(as_json=as_json):
        vehicle = profile_with(profile, position_error_m=position_error_m, rtl_height_m=rtl_height_m)
        flight = read_mission(mission.name, mission.read_bytes())
        for warning in flight.warnings:
            say(f"Note: {warning}")
        timer = StepTimer(progress)
        source = read_model(dsm, timer, crs=crs, z_scale=z_scale, vertical_datum=vertical_datum)
        timer(CERTIFICATE_STEP, None)
        filled, holes = fill_holes(source, max_area_m2=SurfaceParams().fill_hole_area_m2)
        params = _demands(vehicle, required_clearance_m, max_height_above_ground_m).clearance()
        certificate = certify_line(
            filled,
            flown_line(flight, filled),
            params,
            assumptions={"holes_filled": holes.count, "vehicle_profile": vehicle.name},
        )
        summary = {
            **certificate_summary(certificate),
            "items": len(flight.items),
            "dsm": dsm_summary(source, holes_filled=holes.count),
            "seconds": timer.seconds(),
            "warnings": list(flight.warnings),
        }
        end_progress()
        if as_json:
            print_json(summary)
        else:
            typer.echo("\n".join(verdict_lines(summary)))
        raise typer.Exit(DONE if certificate.certified else FAILED)


def _demands(vehicle: VehicleProfile, required_m: float | None, max_height_m: float | None) -> PlanRequest:
    return PlanRequest(
        pois=(), profile=vehicle, required_clearance_m=required_m, max_height_above_ground_m=max_height_m
    )
