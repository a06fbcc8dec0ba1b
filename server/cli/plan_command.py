"""``hedgehop plan``: points of interest and a surface model become a certified mission."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from planning.errors import ParameterError, PoiError
from planning.formats.poi_files import read_pois, warn_swapped
from planning.formats.safe_text import clean_name
from planning.missions.vehicle_profile import path_params
from planning.model import MissionParams, PathParams, Poi, SurfaceParams
from planning.request import PlanRequest, check_request
from planning.route.poi import check_pois, shortest_order
from planning.terrain.dsm import SurfaceModel
from server.cli.shared import options as o
from server.cli.shared.files_in_out import read_small
from server.cli.shared.output import refusing, say
from server.cli.shared.places_given import chosen_heading, parse_place
from server.cli.shared.planning_run import profile_with, run
from server.cli.shared.terrain_given import ModelOptions


def plan(
    dsm: o.DsmFile,
    pois: Annotated[
        Path,
        typer.Argument(
            metavar="POIS", help="Points of interest: CSV, GeoJSON, KML, KMZ, .waypoints or .plan.", show_default=False
        ),
    ],
    out: o.Out,
    as_json: o.AsJson = False,
    crs: o.Crs = None,
    z_scale: o.ZScale = None,
    vertical_datum: o.VerticalDatum = None,
    max_hole_m2: o.MaxHole = 4.0,
    remove_spikes: o.RemoveSpikes = False,
    radius_m: o.Radius = 20.0,
    height_m: o.Height = 5.0,
    smooth_m: o.Smooth = None,
    paper: o.Paper = False,
    mean_speed_m_s: o.MeanSpeed = None,
    max_speed_m_s: o.MaxSpeed = None,
    max_climb_m_s: o.MaxClimb = None,
    max_descent_m_s: o.MaxDescent = None,
    max_accel_m_s2: o.MaxAccel = None,
    step_m: o.Step = 0.1,
    on_steep: o.OnSteep = "raise",
    profile: o.Profile = "generic-quad",
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
    shortest_order: o.ShortestOrder = False,
    loiter_s: o.Loiter = None,
    heading: o.Heading = None,
    heading_deg: o.HeadingDeg = None,
    look_at: o.LookAt = None,
    gimbal_pitch_deg: o.Gimbal = None,
    camera_trigger_m: o.CameraTrigger = None,
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
            radius_m=vehicle_radius_m,
            following_m=following_m,
            dsm_rms_m=dsm_rms_m,
            downwash_m=downwash_m,
            rtl_height_m=rtl_height_m,
        )
        look_at_deg = parse_place(look_at, "--look-at")
        mission = MissionParams(
            max_items=vehicle.max_items,
            excess_height_m=excess_height_m,
            end=end,
            altitude_reference=altitude_reference,
            heading=chosen_heading(heading, heading_deg, look_at_deg),
            heading_deg=heading_deg or 0.0,
            look_at=look_at_deg,
            gimbal_pitch_deg=gimbal_pitch_deg,
            camera_trigger_m=camera_trigger_m,
        )
        request = PlanRequest(
            pois=(),
            profile=vehicle,
            surface=SurfaceParams(radius_m, height_m, smooth_m, floor=not paper, fill_hole_area_m2=max_hole_m2),
            path=path_with(path_params(vehicle), step_m, on_steep),
            mission=mission,
            home_lat_lon_deg=parse_place(home, "--home"),
            required_clearance_m=required_clearance_m,
            max_height_above_ground_m=max_height_above_ground_m,
            way=flown_as,
        )
        check_request(request)
        points = read_pois(pois.name, read_small(pois))
        if not points.pois:
            raise PoiError(
                "The file holds an area and no points.",
                where=clean_name(pois.name),
                advice="`hedgehop survey` plans lines over an area.",
            )
        waiting = with_loiter(points.pois, loiter_s)

        def request_for(model: SurfaceModel) -> PlanRequest:
            for warning in (*points.warnings, *warn_swapped(points.pois, model)):
                say(f"Note: {warning}")
            return replace(request, pois=in_shortest_order(waiting, model) if shortest_order else waiting)

        model = ModelOptions(crs, z_scale, vertical_datum, remove_spikes)
        run(dsm, out, request_for, title=pois.stem, as_json=as_json, model=model)


def path_with(path: PathParams, step_m: float, on_steep: Literal["raise", "slow"]) -> PathParams:
    """The vehicle's limits with the sampling that was asked for."""
    return replace(path, step_m=step_m, on_steep=on_steep)


def with_loiter(pois: Sequence[Poi], loiter_s: float | None) -> tuple[Poi, ...]:
    """The points, those without a waiting time with this one."""
    if loiter_s is None:
        return tuple(pois)
    if not 0 <= loiter_s < 86_400:
        raise ParameterError(f"A wait of {loiter_s:g} s is not possible.", where="--loiter-s", advice="Give seconds.")
    return tuple(poi if poi.loiter_s > 0 else replace(poi, loiter_s=loiter_s) for poi in pois)


def in_shortest_order(pois: Sequence[Poi], model: SurfaceModel) -> tuple[Poi, ...]:
    """The points in the order of the shortest way that starts at the first."""
    xy_m = np.asarray(check_pois(pois, model))
    return tuple(pois[index] for index in shortest_order(xy_m))
