"""What a plan is asked to be, and the checks that need no terrain."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from planning.basics import limits
from planning.basics.plan_model import MissionParams, PathParams, PlannedFor, Poi, SurfaceParams, VehicleProfile
from planning.certificate.certificate_model import ClearanceParams, with_accuracy
from planning.errors import ParameterError
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint
from planning.margins.following_error import Way
from planning.missions.vehicle_profile import path_params
from planning.missions.vehicle_terms import budget_of
from planning.route.camera import LOOKS_DOWN_DEG
from planning.route.survey import SurveyPlan
from planning.terrain.dsm import SurfaceModel


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """Everything that decides a plan, apart from the surface model.

    Speeds and climb limits are those of ``path`` (``path_params`` takes them from a profile); of ``profile`` count the
    rest. ``check_request`` says what cannot be.
    """

    pois: tuple[Poi, ...]
    profile: VehicleProfile
    surface: SurfaceParams = field(default_factory=SurfaceParams)
    path: PathParams = field(default_factory=PathParams)
    mission: MissionParams = field(default_factory=MissionParams)
    home_lat_lon_deg: tuple[float, float] | None = None
    """None: the first point of interest."""
    required_clearance_m: float | None = None
    """None: the sum of the terms (``planning.margins``)."""
    max_height_above_ground_m: float | None = None
    survey: SurveyPlan | None = None
    """The area and the pattern that the points come from; None: they are points of interest."""
    way: Way = "auto"
    """How it is flown: the autopilot departs from the line by that much."""
    fence: Fence = NO_FENCE
    rally: tuple[RallyPoint, ...] = ()

    @property
    def planned_for(self) -> PlannedFor:
        """What the mission's own files carry."""
        profile = effective_profile(self.profile, self.path)
        return PlannedFor(profile, self.way, self.required_clearance_m, self.max_height_above_ground_m)

    def clearance(self) -> ClearanceParams:
        """What is demanded of the line: the only place that says so."""
        budget = budget_of(effective_profile(self.profile, self.path), self.way)
        required_m = budget.total_m if self.required_clearance_m is None else self.required_clearance_m
        return ClearanceParams(
            required_clearance_m=required_m,
            vehicle_radius_m=self.profile.radius_m,
            position_error_m=self.profile.position_error_m,
            rtl_height_m=self.profile.rtl_height_m,
            max_height_above_ground_m=self.max_height_above_ground_m,
            budget=budget,
        )

    def clearance_over(self, model: SurfaceModel) -> ClearanceParams:
        """The same over a surface model, which may tell how exact it is."""
        return with_accuracy(self.clearance(), model)


def clearance_of_planned(planned: PlannedFor) -> ClearanceParams:
    """What a mission's own file demands of its line."""
    return PlanRequest(
        pois=(),
        profile=planned.profile,
        path=path_params(planned.profile),
        required_clearance_m=planned.required_clearance_m,
        max_height_above_ground_m=planned.max_height_above_ground_m,
        way=planned.way,
    ).clearance()


def survey_request(request: PlanRequest, survey: SurveyPlan) -> PlanRequest:
    """The request along a survey's lines, at the height that their spacing and photo distance are meant for.

    Height H becomes the survey's (Melita 2020, eq. 1); a photo distance or gimbal angle of the request's own stays.
    """
    mission = request.mission
    trigger_m, pitch_deg = mission.camera_trigger_m, mission.gimbal_pitch_deg
    return replace(
        request,
        pois=survey.pois,
        survey=survey,
        surface=replace(request.surface, height_m=survey.height_m),
        mission=replace(
            mission,
            camera_trigger_m=survey.trigger_distance_m if trigger_m is None else trigger_m,
            gimbal_pitch_deg=LOOKS_DOWN_DEG if pitch_deg is None else pitch_deg,
        ),
    )


def effective_profile(profile: VehicleProfile, path: PathParams) -> VehicleProfile:
    """The profile with the speeds that a plan is flown at."""
    return replace(
        profile,
        mean_speed_m_s=path.mean_speed_m_s,
        max_speed_m_s=path.max_speed_m_s,
        max_climb_m_s=path.max_climb_m_s,
        max_descent_m_s=path.max_descent_m_s,
        max_accel_m_s2=path.max_accel_m_s2,
    )


def check_request(request: PlanRequest) -> None:
    """Raises ParameterError, naming the first value that no flight can have."""
    path = request.path
    check_demands(request)
    limits.check(request.surface, limits.SURFACE)
    limits.check(path, limits.PATH)
    limits.check(request.mission, limits.MISSION)
    if path.step_m > request.surface.radius_m:
        raise ParameterError(
            f"Sampling step {path.step_m:g} m is larger than radius R, {request.surface.radius_m:g} m.",
            advice="Sample every 0.1 m as a rule: between samples the path does not follow the terrain.",
        )
    if not limits.speeds_agree(path.mean_speed_m_s, path.max_speed_m_s):
        raise ParameterError(
            f"Mean speed {path.mean_speed_m_s:g} m/s and maximum speed {path.max_speed_m_s:g} m/s contradict"
            " each other.",
            advice=f"With this mean, give a maximum above {path.mean_speed_m_s:g} and at most "
            f"{2 * path.mean_speed_m_s:g} m/s: the timing law needs it.",
        )


def check_demands(request: PlanRequest) -> None:
    """Raises ParameterError for a vehicle or a clearance that cannot be; what certifying alone needs."""
    profile = request.profile
    limits.check(profile, limits.PROFILE)
    limits.check(request, limits.DEMANDS)
    if not 0 <= profile.reserve_share < 1:
        raise ParameterError(f"Reserve is {profile.reserve_share:g}.", advice="Give a share from 0 to below 1.")
    if profile.max_items < limits.FEWEST_ITEMS:
        raise ParameterError(
            f"The vehicle is said to take {profile.max_items} mission items.",
            advice=f"A mission has {limits.FEWEST_ITEMS} or more: give the vehicle's true limit.",
        )


def check_size(request: PlanRequest, dsm: SurfaceModel) -> None:
    """Raises ParameterError for a ball larger than the surface model: then units or models were mistaken."""
    sides_m = (dsm.height_px * dsm.resolution_m, dsm.width_px * dsm.resolution_m)
    for name, value, side_m, which in (
        ("Radius R", request.surface.radius_m, min(sides_m), "shorter"),
        ("Height H", request.surface.height_m, max(sides_m), "longer"),
    ):
        if value > side_m:
            raise ParameterError(
                f"{name} is {value:g} m, larger than the surface model, whose {which} side is {side_m:.4g} m.",
                advice="Give a smaller one or a larger surface model.",
            )
