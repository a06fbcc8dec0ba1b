"""``hedgehop plan``: points of interest and a surface model become a certified mission."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planning.dsm import Dsm
from planning.errors import ParameterError
from planning.model import MissionParams, PathParams, SurfaceParams, VehicleProfile
from planning.poi_files import read_pois, warn_swapped
from planning.request import PlanRequest
from server.cli import options as o
from server.cli.output import refusing, say
from server.cli.planning_run import parse_home, profile_with, run


def plan(
    dsm: o.DsmFile,
    pois: Annotated[
        Path, typer.Argument(help="Points of interest: CSV, GeoJSON, KML, .waypoints or .plan.", show_default=False)
    ],
    out: o.Out,
    profile: o.Profile = "generic-quad",
    radius_m: o.Radius = 20.0,
    height_m: Annotated[float, typer.Option("--height-m", help="Height H of the dilating ball.")] = 5.0,
    smooth_m: o.Smooth = None,
    paper: o.Paper = False,
    mean_speed_m_s: o.MeanSpeed = None,
    max_speed_m_s: o.MaxSpeed = None,
    max_climb_m_s: o.MaxClimb = None,
    max_descent_m_s: o.MaxDescent = None,
    max_accel_m_s2: o.MaxAccel = None,
    step_m: o.Step = 0.1,
    on_steep: o.OnSteep = "raise",
    max_items: o.MaxItems = None,
    excess_height_m: o.Excess = 1.0,
    home: o.Home = None,
    end: o.End = "rtl",
    altitude_reference: o.AltitudeReference = "home",
    gimbal_pitch_deg: o.Gimbal = None,
    position_error_m: o.PositionError = None,
    required_clearance_m: o.RequiredClearance = None,
    rtl_height_m: o.RtlHeight = None,
    max_height_above_ground_m: o.MaxHeight = None,
    crs: o.Crs = None,
    z_scale: o.ZScale = None,
    vertical_datum: o.VerticalDatum = None,
    as_json: o.AsJson = False,
) -> None:
    """Plan a terrain-hugging mission over points of interest and prove its clearance."""
    with refusing(as_json=as_json):
        vehicle = profile_with(
            profile,
            mean_speed_m_s=mean_speed_m_s,
            max_speed_m_s=max_speed_m_s,
            max_climb_m_s=max_climb_m_s,
            max_descent_m_s=max_descent_m_s,
            max_accel_m_s2=max_accel_m_s2,
            max_items=max_items,
            position_error_m=position_error_m,
            rtl_height_m=rtl_height_m,
        )
        points = read_pois(pois.name, pois.read_bytes())

        def request_for(model: Dsm) -> PlanRequest:
            for warning in (*points.warnings, *warn_swapped(points.pois, model)):
                say(f"Note: {warning}")
            return PlanRequest(
                pois=points.pois,
                profile=vehicle,
                surface=SurfaceParams(radius_m, height_m, smooth_m, floor=not paper),
                path=path_params(vehicle, step_m, on_steep),
                mission=MissionParams(
                    max_items=vehicle.max_items,
                    excess_height_m=excess_height_m,
                    end=one_of("--end", end, "rtl", "land"),  # type: ignore[arg-type]
                    altitude_reference=one_of("--altitude-reference", altitude_reference, "home", "amsl"),  # type: ignore[arg-type]
                    gimbal_pitch_deg=gimbal_pitch_deg,
                ),
                home_lat_lon_deg=parse_home(home),
                required_clearance_m=required_clearance_m,
                max_height_above_ground_m=max_height_above_ground_m,
            )

        run(
            dsm,
            out,
            request_for,
            title=pois.stem,
            as_json=as_json,
            crs=crs,
            z_scale=z_scale,
            vertical_datum=vertical_datum,
        )


def path_params(vehicle: VehicleProfile, step_m: float, on_steep: str) -> PathParams:
    return PathParams(
        mean_speed_m_s=vehicle.mean_speed_m_s,
        max_speed_m_s=vehicle.max_speed_m_s,
        max_climb_m_s=vehicle.max_climb_m_s,
        max_descent_m_s=vehicle.max_descent_m_s,
        max_accel_m_s2=vehicle.max_accel_m_s2,
        step_m=step_m,
        on_steep=one_of("--on-steep", on_steep, "raise", "slow"),  # type: ignore[arg-type]
    )


def one_of(option: str, value: str, *choices: str) -> str:
    if value not in choices:
        raise ParameterError(f"{value!r} is not possible.", where=option, advice=f"Choose {' or '.join(choices)}.")
    return value
