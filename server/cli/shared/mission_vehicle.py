"""Vehicle and demands of a mission that was planned before: its own files carry them, options win and are said."""

from __future__ import annotations

from dataclasses import replace

from planning.basics.plan_model import Mission, PathParams, PlannedFor, VehicleProfile
from planning.margins.following_error import WAY_NAMES, Way
from planning.missions.feasibility import commanded_speed_m_s
from planning.missions.vehicle_profile import DEFAULT_PROFILE, load_profile, path_params
from planning.planner.request import PlanRequest, check_demands
from server.cli.shared.options import ClearanceOptions, VehicleOptions, of_vehicle
from server.cli.shared.output import harmless, say_notes


def judged_by(flight: Mission, given: VehicleOptions, demands: ClearanceOptions, way: Way | None) -> PlanRequest:
    """Vehicle (its ``profile``) and demands of a mission that was planned before; ``way`` None: as it was planned."""
    vehicle = _vehicle(flight, given.profile, of_vehicle(given, demands))
    required_m, highest_m = demands.required_clearance_m, demands.max_height_above_ground_m
    own = flight.planned_for or PlannedFor(vehicle)
    if required_m is not None and own.required_clearance_m not in (None, required_m):
        say_notes(f"{required_m:g} m are required instead of the mission's own {own.required_clearance_m:g} m.")
    if way is not None and flight.planned_for is not None and way != own.way:
        say_notes(f"planned for {WAY_NAMES[own.way]}, judged as flown in {WAY_NAMES[way]}.")
    request = PlanRequest(
        pois=(),
        profile=vehicle,
        path=_as_fast_as_commanded(path_params(vehicle), flight),
        required_clearance_m=own.required_clearance_m if required_m is None else required_m,
        max_height_above_ground_m=own.max_height_above_ground_m if highest_m is None else highest_m,
        way=own.way if way is None else way,
    )
    check_demands(request)
    return request


def _vehicle(flight: Mission, profile: str | None, overrides: dict[str, float]) -> VehicleProfile:
    """The named profile, else the mission's own, else the default one; options override it. Says which it is."""
    own = None if flight.planned_for is None else flight.planned_for.profile
    if profile is not None:
        vehicle = load_profile(profile)
        if own is not None and own != vehicle:
            say_notes(f"--profile {harmless(profile)} is taken instead of the mission's own {harmless(own.name)}.")
    elif own is not None:
        vehicle = own
        say_notes(
            f"vehicle as in the mission's file: {harmless(own.name)}, position error {own.position_error_m:g} m,"
            f" return height {own.rtl_height_m:g} m."
        )
    else:
        vehicle = load_profile(DEFAULT_PROFILE)
        say_notes(f"the mission's file names no vehicle: {vehicle.name} is taken. Give --profile for another.")
    for key, value in overrides.items():
        if own is not None and (planned := getattr(own, key)) != value:
            words = "what follows from the mission's own" if planned is None else f"the mission's own {planned:g}"
            say_notes(f"{key.removesuffix('_m').replace('_', ' ')} of {value:g} m is taken instead of {words}.")
    return replace(vehicle, **overrides)


def _as_fast_as_commanded(path: PathParams, flight: Mission) -> PathParams:
    """The faster it is flown, the less closely the line is followed: the mission's own speeds count, too."""
    return replace(path, max_speed_m_s=max(path.max_speed_m_s, commanded_speed_m_s(flight) or 0.0))
