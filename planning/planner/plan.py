"""The main job: points of interest and a surface model become a mission with a clearance certificate.

Melita 2020, fig. 7: DSM -> dilate -> smooth -> POIs -> trajectory -> files; then decimation to what the
vehicle can hold and a certificate of what it will really fly, taken from the exported files read back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from planning.basics.plan_model import (
    FlownLine,
    Home,
    Mission,
    MissionParams,
    SampledPath,
    Surfaces,
    Timing,
    VehicleProfile,
)
from planning.certificate.certificate_model import BetterHome, Certificate
from planning.certificate.clearance import certify
from planning.certificate.home_stand import DROP_M
from planning.errors import MissionError
from planning.flight_time.predict import PredictedTime, predict_duration
from planning.formats import qgc_plan, wpl
from planning.formats.safe_text import clean_name
from planning.margins.words import uncovered_words
from planning.missions.feasibility import Feasibility, feasibility_of, photos_row
from planning.missions.flown import flown_line
from planning.missions.home import HOME_DECIMALS, default_home, home_from_dsm, home_there, moved_note
from planning.missions.mission import BuiltMission, Choice, build_mission, decimation_trade
from planning.planner.laid import Detour, Route, before_home, home_place, laid_route
from planning.planner.part import (
    Ground,
    Grounds,
    felt_m,
    hole_assumptions,
    least_margin_m,
    looked_over,
    mission_places,
    rally_places,
    was_enough,
)
from planning.planner.request import PlanRequest, check_request, check_size, effective_profile
from planning.route.path import sampled_path
from planning.route.poi import check_pois
from planning.route.survey_coverage import SurveyCoverage, survey_coverage
from planning.route.timing import path_timing
from planning.safe_surface.surface import FLOOR_SHARE, safe_surface, safe_surface_at
from planning.terrain.dsm import Dsm, SurfaceModel
from planning.terrain.holes import HoleReport

Progress = Callable[[str, float | None], None]

SURFACE_STEP = "Dilating the surface"
PATH_STEP = "Laying the path"
CERTIFICATE_STEP = "Proving the clearance"

_READ_BACK_TOLERANCE_M = 0.001


@dataclass(frozen=True, slots=True)
class Plan:
    """A finished plan: what was asked, what was made of it, and the proof."""

    request: PlanRequest
    ground: Dsm
    """The surface model, or the part of a large one that the plan needs."""
    dsm: Dsm
    """The same with its small holes filled."""
    holes: HoleReport
    """What was filled."""
    surfaces: Surfaces
    path: SampledPath
    timing: Timing
    built: BuiltMission
    line: FlownLine
    certificate: Certificate
    predicted: PredictedTime
    coverage: SurveyCoverage | None
    """What a survey's photos really see; None where the plan is no survey, or takes no photos."""
    feasibility: Feasibility
    """Whether the vehicle can fly it: a verdict of its own, beside the certificate's."""
    detours: tuple[Detour, ...]
    """Points of the path that nobody asked for: it is laid around the fence there."""
    warnings: tuple[str, ...]

    @property
    def mission(self) -> Mission:
        return self.built.mission

    @property
    def detour_vertices(self) -> list[int]:
        """Of the path, in the order of ``detours``: all without a point but home's, which comes first."""
        return [k for k, poi in enumerate(self.path.vertex_poi) if poi is None and k > 0]


def plan_mission(
    model: SurfaceModel,
    request: PlanRequest,
    *,
    report: Progress = lambda step, share: None,
    assumptions: Mapping[str, object] | None = None,
) -> Plan:
    """Plans, decimates and certifies one mission (Melita 2020, sections 5 and 6).

    ``assumptions`` say what was done to the model before; they join those of the certificate.
    Of a large model only the part that the plan needs is looked at; it grows until the certificate is that
    over the whole model. Raises ParameterError, PoiError, DatumError or MissionError; a plan that is merely
    too close to the ground is returned with a certificate that says so.
    """
    check_request(request)
    check_size(request, model)
    model = looked_over(model, _flown_to(model, request), request.clearance().required_clearance_m)
    request = before_home(model, request)
    report(SURFACE_STEP, 0.0)
    grounds = Grounds(model, request.surface.fill_hole_area_m2)
    first = grounds.around(_points(model, request), least_margin_m(model, request))
    check_pois(request.pois, first.filled, bounds_m=model.bounds_m)
    job = _Job(request, grounds, report, assumptions or {})
    home, why = _home(model, request)
    plan = _planned_from(job, home, why)
    better = _better_default(plan)
    if better is None:
        return plan
    return _planned_from(job, home_there(model, better), why or "a vehicle may stand too low for the line's clearance")


@dataclass(frozen=True, slots=True)
class _Job:
    """What stays the same wherever home is put."""

    request: PlanRequest
    grounds: Grounds
    report: Progress
    assumptions: Mapping[str, object]

    @property
    def model(self) -> SurfaceModel:
        return self.grounds.model


def _planned_from(job: _Job, home: Home, why_moved: str) -> Plan:
    """``why_moved``: what is wrong with home at the first point; empty when it is there or was given.

    Over the models around what is flown in the end, as all who judge its file will look at them.
    """
    plan, look = _planned_over(job, home, why_moved, None)
    flown = _look_of(plan, look)
    if flown is look:
        return plan
    again, _ = _planned_over(job, home, why_moved, flown)
    return again if _look_of(again, flown) is flown else plan


def _look_of(plan: Plan, look: SurfaceModel) -> SurfaceModel:
    required_m = plan.request.clearance().required_clearance_m
    return looked_over(look, mission_places(look, plan.mission), required_m)


def _planned_over(job: _Job, home: Home, why_moved: str, look: SurfaceModel | None) -> tuple[Plan, SurfaceModel]:
    """The plan, and the model as it was looked at; ``look``: None: that around the path that is laid."""
    model, request = job.model, job.request
    route = laid_route(model, request, home)
    job = replace(job, request=replace(request, pois=route.pois))
    laid_xy_m = np.vstack([route.vertices_xy_m, home_place(model, home)])
    points_xy_m = np.vstack([_points(model, request), laid_xy_m])
    flown_xy_m = np.vstack([_flown_to(model, request), laid_xy_m])
    wider = looked_over(model, flown_xy_m, request.clearance().required_clearance_m) if look is None else look
    if wider is not model:  # a way around the fence may lead to other models of a catalogue
        model, job = wider, replace(job, grounds=Grounds(wider, request.surface.fill_hole_area_m2))
        home = home_from_dsm(model, (home.lat_deg, home.lon_deg))
    feels_m = felt_m(request)

    def is_enough(ground: Ground, plan: Plan) -> bool:
        return was_enough(ground, model, plan.line, plan.certificate, felt_m=feels_m)

    plan = job.grounds.judged(
        points_xy_m,
        least_margin_m(model, request),
        lambda ground: _planned(job, ground, home, why_moved, route),
        is_enough,
    )
    return plan, model


def _planned(job: _Job, ground: Ground, home: Home, why_moved: str, route: Route) -> Plan:
    request, filled, holes = job.request, ground.filled, ground.holes
    first = request.pois[0]
    home_notes = [moved_note((first.lat_deg, first.lon_deg), home, why_moved)] if why_moved else []
    vertices_xy_m, vertex_poi = route.vertices_xy_m, route.vertex_poi
    # Melita 2020, fig. 7
    surfaces = safe_surface(filled, request.surface, around_xy_m=vertices_xy_m)
    job.report(PATH_STEP, 0.5)
    path = sampled_path(filled, lambda xy_m: safe_surface_at(surfaces, xy_m), vertices_xy_m, vertex_poi, request.path)
    timing = path_timing(path, request.path, loiter_s=_loiter_s(request, vertex_poi))
    profile = effective_profile(request.profile, request.path)
    built = _mission(job, filled, profile, path, home)
    built = replace(built, mission=_signed(built.mission, job))
    job.report(CERTIFICATE_STEP, 0.8)
    line = read_back(built.mission, filled)
    assumed = {**_assumptions(request, surfaces, holes), **job.model.said_of_look, **job.assumptions}
    certificate = certify(filled, line, request.clearance_over(filled), ground=job.model, assumptions=assumed)
    predicted = predict_duration(built.mission, profile, filled)
    coverage = _coverage(filled, request, line)
    return Plan(
        request=request,
        ground=ground.dsm,
        dsm=filled,
        holes=holes,
        surfaces=surfaces,
        path=path,
        timing=timing,
        built=built,
        line=line,
        certificate=certificate,
        predicted=predicted,
        coverage=coverage,
        feasibility=_feasibility(built.mission, profile, predicted, coverage),
        detours=route.detours,
        warnings=(*home_notes, *route.notes, *built.warnings, *_warnings(filled, request)),
    )


def _signed(mission: Mission, job: _Job) -> Mission:
    """With what it was planned for, over which surface model, and within which fence."""
    model, request = job.model, job.request
    return replace(
        mission,
        planned_for=request.planned_for,
        surface_sha256=model.sha256,
        surface_name=clean_name(model.name),
        fence=request.fence,
        rally=request.rally,
    )


def _better_default(plan: Plan) -> BetterHome | None:
    """Where home does better than at the place that was chosen for want of one; None: nowhere, or it was given."""
    stand = plan.certificate.home
    if plan.request.home_lat_lon_deg is not None or stand is None or stand.better is None:
        return None
    return stand.better if stand.better.does else None


def read_back(mission: Mission, dsm: Dsm) -> FlownLine:
    """The line that the exported files describe, read by their own readers.

    Raises MissionError when a file does not describe the flight that was planned: then a writer is wrong.
    """
    meant = flown_line(mission, dsm)
    plan = qgc_plan.read_plan(qgc_plan.write_plan(mission))
    lines = {
        "mission.waypoints": flown_line(wpl.read_wpl(wpl.write_wpl(mission)), dsm),
        "mission.plan": flown_line(plan, dsm),
    }
    same_fence = (plan.fence, plan.rally) == (mission.fence, mission.rally)
    for name, line in lines.items():
        if not (_same_flight(line, meant) and same_fence):
            raise MissionError(
                "The exported file does not describe the flight that was planned.",
                where=name,
                advice="Do not fly this plan; report it with the points and the surface model.",
            )
    # WPL holds no fence; the `.plan` does.
    return replace(lines["mission.waypoints"], fence=mission.fence, rally=mission.rally)


def _same_flight(line: FlownLine, meant: FlownLine) -> bool:
    """Whether the line is the one that was meant, to the millimetre."""
    if line.points_m.shape != meant.points_m.shape or line.ends_with_rtl != meant.ends_with_rtl:
        return False
    off_m = line.points_m - meant.points_m
    off_home_m = np.abs([*np.subtract(line.home_xy_m, meant.home_xy_m), line.home_alt_dsm_m - meant.home_alt_dsm_m])
    return bool(max(np.abs(off_m).max(), off_home_m.max()) <= _READ_BACK_TOLERANCE_M)


def plan_trade(plan: Plan) -> list[Choice]:
    """Waypoints and flight time for a ladder of excess heights over the same path."""
    request = plan.request
    profile = effective_profile(request.profile, request.path)
    params = replace(request.mission, end="rtl")
    return decimation_trade(plan.path, plan.mission.home, params, profile, plan.dsm, request.pois)


def _points(model: SurfaceModel, request: PlanRequest) -> np.ndarray:
    """(N, 2) projected places that were asked for: those that are flown to, and a survey's area."""
    area = [] if request.survey is None else request.survey.polygon_lat_lon_deg
    area_m = model.xy_from_lat_lon(np.array(area, np.float64).reshape(-1, 2))
    return np.vstack([_flown_to(model, request), area_m])


def _flown_to(model: SurfaceModel, request: PlanRequest) -> np.ndarray:
    """(N, 2) projected places: points, home where it was given, rally points."""
    places = [(poi.lat_deg, poi.lon_deg) for poi in request.pois]
    home = [request.home_lat_lon_deg] if request.home_lat_lon_deg is not None else []
    asked_m = model.xy_from_lat_lon(np.array([*places, *home]))
    return np.vstack([asked_m, rally_places(model, request.rally)])


def _home(model: SurfaceModel, request: PlanRequest) -> tuple[Home, str]:
    """Home, and why it is not at the first point, where it was chosen.

    Rounded as files carry it, before its height is taken: at a cell's edge the rounding may change the cell.
    """
    lat_deg, lon_deg = request.home_lat_lon_deg or (request.pois[0].lat_deg, request.pois[0].lon_deg)
    place = (round(lat_deg, HOME_DECIMALS), round(lon_deg, HOME_DECIMALS))
    if request.home_lat_lon_deg is not None:
        return home_from_dsm(model, place), ""
    return default_home(model, place, request.clearance_over(model), most_drop_m=_expected_spare_m(model, request))


def _expected_spare_m(model: SurfaceModel, request: PlanRequest) -> float:
    """Clearance beyond what is required, before there is a line: the surface's floor lies 0.8 H above the model."""
    floor_m = FLOOR_SHARE * request.surface.height_m if request.surface.floor else 0.0
    return max(DROP_M, floor_m - request.clearance_over(model).required_clearance_m)


def _loiter_s(request: PlanRequest, vertex_poi: tuple[int | None, ...]) -> np.ndarray:
    return np.array([0.0 if i is None else request.pois[i].loiter_s for i in vertex_poi])


def _mission(job: _Job, dsm: Dsm, profile: VehicleProfile, path: SampledPath, home: Home) -> BuiltMission:
    """Items of the mission; a landing at home first learns how high the way back must be."""
    request = job.request

    def build(params: MissionParams, needed_m: float | None = None) -> BuiltMission:
        return build_mission(path, home, params, profile, dsm, request.pois, rtl_height_needed_m=needed_m)

    if request.mission.end == "rtl" or request.mission.land_transit_height_m is not None:
        return build(request.mission)
    scout = build(replace(request.mission, end="rtl")).mission
    demanded = request.clearance_over(dsm)
    needed_m = certify(dsm, flown_line(scout, dsm), demanded, ground=job.model).rtl_height_needed_m
    return build(request.mission, needed_m if math.isfinite(needed_m) else profile.rtl_height_m)


def _assumptions(request: PlanRequest, surfaces: Surfaces, holes: HoleReport) -> dict[str, object]:
    return {
        "ball_radius_m": request.surface.radius_m,
        "ball_height_m": request.surface.height_m,
        "dilation": surfaces.method,
        "paper_pipeline": not request.surface.floor,
        **hole_assumptions(holes, request.surface.fill_hole_area_m2),
        "vehicle_profile": request.profile.name,
    }


def _feasibility(
    mission: Mission, profile: VehicleProfile, predicted: PredictedTime, coverage: SurveyCoverage | None
) -> Feasibility:
    found = feasibility_of(mission, profile, predicted.total_s)
    return found if coverage is None else found.with_rows(photos_row(coverage.faults()))


def _coverage(dsm: Dsm, request: PlanRequest, line: FlownLine) -> SurveyCoverage | None:
    camera = request.profile.camera
    if request.survey is None or camera is None:
        return None
    return survey_coverage(dsm, line, request.survey, camera, request.mission)


def _warnings(dsm: Dsm, request: PlanRequest) -> list[str]:
    demanded = request.clearance_over(dsm)
    uncovered = uncovered_words(demanded.budget, demanded.required_clearance_m)
    return [] if uncovered is None else [uncovered]
