"""``hedgehop survey``: a back-and-forth flight over a polygon, hugging the terrain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from planning.dsm import Dsm
from planning.errors import ParameterError, PoiError
from planning.model import MissionParams, SurfaceParams
from planning.poi_files import read_pois
from planning.request import PlanRequest
from planning.survey import survey_lines
from server.cli import options as o
from server.cli.output import refusing, say
from server.cli.plan import one_of, path_params
from server.cli.planning_run import parse_home, profile_with, run


def survey(
    dsm: o.DsmFile,
    polygon: Annotated[Path, typer.Argument(help="Area: GeoJSON or KML polygon.", show_default=False)],
    out: o.Out,
    profile: o.Profile = "mapper-rtk",
    gsd_cm: Annotated[
        float | None, typer.Option("--gsd-cm", help="Ground sampling distance; sets the height (default 1 cm).")
    ] = None,
    height_m: Annotated[float | None, typer.Option("--height-m", help="Height above the surface instead.")] = None,
    side_overlap: Annotated[float, typer.Option("--side-overlap", help="Share between lines.")] = 0.7,
    front_overlap: Annotated[float, typer.Option("--front-overlap", help="Share between photos.")] = 0.8,
    angle_deg: Annotated[
        float | None, typer.Option("--angle-deg", help="Direction of the lines from grid north; default: fewest turns.")
    ] = None,
    radius_m: o.Radius = 20.0,
    smooth_m: o.Smooth = None,
    paper: o.Paper = False,
    mean_speed_m_s: o.MeanSpeed = None,
    max_speed_m_s: o.MaxSpeed = None,
    step_m: o.Step = 0.1,
    on_steep: o.OnSteep = "raise",
    max_items: o.MaxItems = None,
    excess_height_m: o.Excess = 1.0,
    home: o.Home = None,
    end: o.End = "rtl",
    position_error_m: o.PositionError = None,
    required_clearance_m: o.RequiredClearance = None,
    rtl_height_m: o.RtlHeight = None,
    max_height_above_ground_m: o.MaxHeight = None,
    crs: o.Crs = None,
    z_scale: o.ZScale = None,
    vertical_datum: o.VerticalDatum = None,
    as_json: o.AsJson = False,
) -> None:
    """Plan a back-and-forth survey of an area and prove its clearance."""
    with refusing(as_json=as_json):
        vehicle = profile_with(
            profile,
            mean_speed_m_s=mean_speed_m_s,
            max_speed_m_s=max_speed_m_s,
            max_items=max_items,
            position_error_m=position_error_m,
            rtl_height_m=rtl_height_m,
        )
        if vehicle.camera is None:
            raise ParameterError(
                f"The profile {vehicle.name} has no camera.", where="--profile", advice="Use one with a [camera] table."
            )
        camera = vehicle.camera
        area = read_pois(polygon.name, polygon.read_bytes())
        if area.polygon is None:
            raise PoiError("There is no polygon in it.", where=polygon.name, advice="Draw the area as one polygon.")
        corners = np.array(area.polygon)

        def request_for(model: Dsm) -> PlanRequest:
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
            say(
                f"Note: {lines.lines} lines {lines.line_spacing_m:.1f} m apart, {lines.height_m:.1f} m above the "
                f"surface, a photo every {lines.trigger_distance_m:.1f} m."
            )
            return PlanRequest(
                pois=lines.pois,
                profile=vehicle,
                surface=SurfaceParams(radius_m, lines.height_m, smooth_m, floor=not paper),
                path=path_params(vehicle, step_m, on_steep),
                mission=MissionParams(
                    max_items=vehicle.max_items,
                    excess_height_m=excess_height_m,
                    end=one_of("--end", end, "rtl", "land"),  # type: ignore[arg-type]
                    gimbal_pitch_deg=-90.0,
                    camera_trigger_m=lines.trigger_distance_m,
                ),
                home_lat_lon_deg=parse_home(home),
                required_clearance_m=required_clearance_m,
                max_height_above_ground_m=max_height_above_ground_m,
            )

        run(
            dsm,
            out,
            request_for,
            title=polygon.stem,
            as_json=as_json,
            crs=crs,
            z_scale=z_scale,
            vertical_datum=vertical_datum,
        )
