"""What a plan is asked to be, and the checks that need no terrain."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from planning.errors import ParameterError
from planning.model import ClearanceParams, MissionParams, PathParams, Poi, SurfaceParams, VehicleProfile


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """Everything that decides a plan, apart from the surface model."""

    pois: tuple[Poi, ...]
    profile: VehicleProfile
    surface: SurfaceParams = field(default_factory=SurfaceParams)
    path: PathParams = field(default_factory=PathParams)
    mission: MissionParams = field(default_factory=MissionParams)
    home_lat_lon_deg: tuple[float, float] | None = None
    """None: the first point of interest."""
    required_clearance_m: float | None = None
    """None: position error + downwash + vehicle radius."""
    max_height_above_ground_m: float | None = None

    def clearance(self) -> ClearanceParams:
        required = self.required_clearance_m
        if required is None:
            required = ClearanceParams.default_required_m(
                position_error_m=self.profile.position_error_m, vehicle_radius_m=self.profile.radius_m
            )
        return ClearanceParams(
            required_clearance_m=required,
            vehicle_radius_m=self.profile.radius_m,
            position_error_m=self.profile.position_error_m,
            rtl_height_m=self.profile.rtl_height_m,
            max_height_above_ground_m=self.max_height_above_ground_m,
        )


def check_request(request: PlanRequest) -> None:
    """Raises ParameterError, naming every value that no flight can have."""
    path, profile = request.path, request.profile
    _positive("Radius R", request.surface.radius_m, "m")
    _positive("Height H", request.surface.height_m, "m")
    for name, value, unit in (
        ("Mean speed", path.mean_speed_m_s, "m/s"),
        ("Maximum speed", path.max_speed_m_s, "m/s"),
        ("Climb limit", path.max_climb_m_s, "m/s"),
        ("Descent limit", path.max_descent_m_s, "m/s"),
        ("Acceleration limit", path.max_accel_m_s2, "m/s2"),
        ("Sampling step", path.step_m, "m"),
        ("Vehicle radius", profile.radius_m, "m"),
        ("Endurance", profile.endurance_s, "s"),
        ("RTL height", profile.rtl_height_m, "m"),
    ):
        _positive(name, value, unit)
    _at_least_zero("Position error", profile.position_error_m, "m")
    _at_least_zero("Excess height", request.mission.excess_height_m, "m")
    if request.surface.smooth_sigma_m is not None:
        _at_least_zero("Smoothing", request.surface.smooth_sigma_m, "m")
    if request.required_clearance_m is not None:
        _positive("Required clearance", request.required_clearance_m, "m")
    if request.max_height_above_ground_m is not None:
        _positive("Maximum height above ground", request.max_height_above_ground_m, "m")
    if not 0 <= profile.reserve_share < 1:
        raise ParameterError(f"Reserve is {profile.reserve_share:g}.", advice="Give a share from 0 to below 1.")
    if not path.mean_speed_m_s < path.max_speed_m_s <= 2 * path.mean_speed_m_s:
        raise ParameterError(
            f"Mean speed {path.mean_speed_m_s:g} m/s and maximum speed {path.max_speed_m_s:g} m/s contradict each other.",
            advice="The timing law needs mean < maximum <= 2 x mean.",
        )


def _positive(name: str, value: float, unit: str) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ParameterError(f"{name} is {value:g} {unit}.", advice="It must be a number above zero.")


def _at_least_zero(name: str, value: float, unit: str) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise ParameterError(f"{name} is {value:g} {unit}.", advice="It must be zero or more.")
