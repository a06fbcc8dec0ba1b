"""``hedgehop survey``: a back-and-forth flight over a polygon, hugging the terrain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from planning.errors import ParameterError, PoiError
from planning.formats.poi_files import read_pois
from planning.formats.safe_text import clean_name
from planning.missions.vehicle_profile import path_params
from planning.model import MissionParams, SurfaceParams
from planning.request import PlanRequest, check_request, survey_request
from planning.route.survey import SurveyPlan, survey_lines
from planning.terrain.dsm import SurfaceModel
from server.cli.plan_command import path_with
from server.cli.shared import options as o
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import refusing, say
from server.cli.shared.places_given import parse_place
from server.cli.shared.planning_run import profile_with, run
from server.cli.shared.terrain_given import ModelOptions

_PATTERN = "Pattern"


def survey(
    dsm: o.DsmFile,
    polygon: Annotated[
        Path, typer.Argument(metavar="POLYGON", help="Area: GeoJSON or KML polygon.", show_default=False)
    ],
    out: o.Out,
    as_json: o.AsJson = False,
    gsd_cm: Annotated[
        float | None,
        typer.Option(
            "--gsd-cm", help="Ground sampling distance; sets the height. Default 1 cm.", rich_help_panel=_PATTERN
        ),
    ] = None,
    height_m: Annotated[
        float | None, typer.Option("--height-m", help="Height above the surface instead.", rich_help_panel=_PATTERN)
    ] = None,
    side_overlap: Annotated[
        float, typer.Option("--side-overlap", help="Share between lines.", rich_help_panel=_PATTERN)
    ] = 0.7,
    front_overlap: Annotated[
        float, typer.Option("--front-overlap", help="Share between photos.", rich_help_panel=_PATTERN)
    ] = 0.8,
    angle_deg: Annotated[
        float | None,
        typer.Option(
            "--angle-deg",
            help="Direction of the lines from grid north; default: fewest turns.",
            rich_help_panel=_PATTERN,
        ),
    ] = None,
    crs: o.Crs = None,
    z_scale: o.ZScale = None,
    vertical_datum: o.VerticalDatum = None,
    max_hole_m2: o.MaxHole = 4.0,
    remove_spikes: o.RemoveSpikes = False,
    radius_m: o.Radius = 20.0,
    smooth_m: o.Smooth = None,
    paper: o.Paper = False,
    mean_speed_m_s: o.MeanSpeed = None,
    max_speed_m_s: o.MaxSpeed = None,
    max_climb_m_s: o.MaxClimb = None,
    max_descent_m_s: o.MaxDescent = None,
    max_accel_m_s2: o.MaxAccel = None,
    step_m: o.Step = 0.1,
    on_steep: o.OnSteep = "raise",
    profile: o.Profile = "mapper-rtk",
    max_items: o.MaxItems = None,
    position_error_m: o.PositionError = None,
    vehicle_radius_m: o.VehicleRadius = None,
    following_m: o.FollowingError = None,
    dsm_rms_m: o.DsmRms = None,
    downwash_m: o.Downwash = None,
    rtl_height_m: o.RtlHeight = None,
    flown_as: o.FlownAs = "auto",
    required_clearance_m: o.RequiredClearance = None,
    max_height_above_ground_m: o.MaxHeight = None,
    home: o.Home = None,
    end: o.End = "rtl",
    altitude_reference: o.AltitudeReference = "home",
    excess_height_m: o.Excess = 1.0,
) -> None:
    """Plan a back-and-forth survey of an area and prove its clearance."""
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
            radius_m=vehicle_radius_m,
            following_m=following_m,
            dsm_rms_m=dsm_rms_m,
            downwash_m=downwash_m,
            rtl_height_m=rtl_height_m,
        )
        if vehicle.camera is None:
            raise ParameterError(
                f"The profile {clean_name(vehicle.name)} has no camera.",
                where="--profile",
                advice="Use one with a [camera] table.",
            )
        camera = vehicle.camera
        mission = MissionParams(
            max_items=vehicle.max_items,
            excess_height_m=excess_height_m,
            end=end,
            altitude_reference=altitude_reference,
        )
        request = PlanRequest(
            pois=(),
            profile=vehicle,
            surface=SurfaceParams(radius_m, smooth_sigma_m=smooth_m, floor=not paper, fill_hole_area_m2=max_hole_m2),
            path=path_with(path_params(vehicle), step_m, on_steep),
            mission=mission,
            home_lat_lon_deg=parse_place(home, "--home"),
            required_clearance_m=required_clearance_m,
            max_height_above_ground_m=max_height_above_ground_m,
            way=flown_as,
        )
        check_request(request)
        corners = _corners(polygon)

        def request_for(model: SurfaceModel) -> PlanRequest:
            lines = survey_lines(
                corners,
                model,
                camera=camera,
                gsd_cm=1.0 if gsd_cm is None and height_m is None else gsd_cm,
                height_m=height_m,
                side_overlap=side_overlap,
                front_overlap=front_overlap,
                angle_deg=angle_deg,
            )
            _say_pattern(lines)
            return survey_request(request, lines)

        model = ModelOptions(crs, z_scale, vertical_datum, remove_spikes)
        run(dsm, out, request_for, title=polygon.stem, as_json=as_json, model=model)


def _corners(polygon: Path) -> np.ndarray:
    """(N, 2) latitude and longitude in degrees."""
    area = read_pois(polygon.name, read_small(polygon))
    if area.polygon is None:
        raise PoiError(
            "There is no polygon in it.", where=clean_name(polygon.name), advice="Draw the area as one polygon."
        )
    for warning in area.warnings:
        say(f"Note: {warning}")
    return np.array(area.polygon)


def _say_pattern(lines: SurveyPlan) -> None:
    pattern = f"{lines.lines} lines {lines.line_spacing_m:.1f} m apart" if lines.lines > 1 else "one line"
    say(
        f"Note: {pattern}, {lines.height_m:.1f} m above the surface, {lines.gsd_cm:.2f} cm per pixel, "
        f"a photo every {lines.trigger_distance_m:.1f} m."
    )
