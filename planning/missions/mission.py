"""A path becomes mission items: few straight legs that are nowhere below it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Home, Mission, MissionParams, Poi, SampledPath, VehicleProfile
from planning.errors import CapacityError
from planning.flight_time.predict import predict_duration
from planning.missions.decimate import Decimated, decimate_to_fit
from planning.missions.home import check_start, item_heights
from planning.missions.mission_items import (
    GROUND_SPEED,
    LANDING_ITEMS,
    Heights,
    Place,
    action,
    aiming,
    fixed_heading_deg,
    landing,
    return_to_launch,
    starting,
    stopping,
    takeoff,
    unset,
    waypoint,
)
from planning.missions.vehicle_profile import path_params
from planning.route.slopes import slope_limits
from planning.terrain.dsm import Dsm

EXCESSES_M = (0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
NO_LIMIT = 1_000_000


@dataclass(frozen=True, slots=True)
class BuiltMission:
    """A mission and what became of the path in it."""

    mission: Mission
    kept: Decimated
    """The path's samples that became waypoints."""
    warnings: tuple[str, ...]

    @property
    def waypoints(self) -> int:
        """Along the path; those of a landing at home are not counted."""
        return len(self.kept.sample)

    @property
    def excess_height_m(self) -> float:
        """The excess that was allowed in the end."""
        return self.kept.excess_height_m


@dataclass(frozen=True, slots=True)
class Choice:
    """One excess height and what it leads to."""

    excess_height_m: float
    waypoints: int
    items: int
    """Everything that is uploaded."""
    duration_s: float
    """Take-off to touchdown, as the autopilot flies it."""


def build_mission(
    path: SampledPath,
    home: Home,
    params: MissionParams,
    profile: VehicleProfile,
    dsm: Dsm,
    pois: Sequence[Poi],
    *,
    rtl_height_needed_m: float | None = None,
) -> BuiltMission:
    """The mission along ``path``, which starts over home, at the profile's speeds.

    Speed, vertical take-off, waypoints (one for each vertex, between them as few as
    ``params.excess_height_m`` allows; that is raised, with a warning, when the items would be more
    than the vehicle takes), loiter, heading, gimbal and camera, return. ``rtl_height_needed_m`` above
    home is the transit height of a landing at home where ``params`` set none; without both it is the
    profile's RTL height. Raises ``CapacityError``, ``DatumError``, ``MissionError``, ``ParameterError``.
    """
    heights = item_heights(home, params, dsm)
    check_start(path, home, dsm)
    before = aiming(params, profile.firmware, heights, dsm)
    after = starting(params, profile.firmware)
    closing = stopping(params)
    yaw_deg = _yaw_deg(params, profile)
    others = 2 + len(before) + len(after) + len(closing) + (1 if params.end == "rtl" else LANDING_ITEMS)
    kept = _decimated(path, params, profile, heights, others=others)
    degrees = dsm.lat_lon_from_xy(path.xy_m[kept.sample])
    places = [Place(lat, lon, alt) for lat, lon, alt in np.column_stack([degrees, kept.alt_dsm_m]).tolist()]
    holds = _holds(path, kept, pois)
    points = [waypoint(p, heights, hold_s=hold, yaw_deg=yaw_deg) for p, hold in zip(places, holds, strict=True)]
    if params.end == "rtl":
        closing += return_to_launch()
    else:
        transit_m = home.alt_dsm_m + _transit_height_m(params, profile, rtl_height_needed_m)
        closing += landing(home, places[-1], heights, transit_alt_dsm_m=transit_m, yaw_deg=yaw_deg)
    up = [
        action(MavCmd.DO_CHANGE_SPEED, GROUND_SPEED, profile.max_speed_m_s, -1.0),
        takeoff(home, heights, places[0].alt_dsm_m, profile.firmware),
    ]
    mission = Mission(
        home=home,
        items=(*up, *before, points[0], *after, *points[1:], *closing),
        firmware=profile.firmware,
        pois=tuple(pois),
        cruise_speed_m_s=profile.max_speed_m_s,
    )
    return BuiltMission(mission, kept, _warnings(params, profile, kept))


def decimation_trade(
    path: SampledPath,
    home: Home,
    params: MissionParams,
    profile: VehicleProfile,
    dsm: Dsm,
    pois: Sequence[Poi],
    *,
    excesses_m: Sequence[float] = EXCESSES_M,
) -> list[Choice]:
    """What a closer fit to the path costs in waypoints and time, regardless of the vehicle's item limit."""
    unlimited = replace(profile, max_items=NO_LIMIT)
    choices = []
    for excess_m in excesses_m:
        asked = replace(params, excess_height_m=excess_m, max_items=NO_LIMIT)
        built = build_mission(path, home, asked, unlimited, dsm, pois)
        duration_s = predict_duration(built.mission, profile, dsm).total_s
        choices.append(Choice(excess_m, built.waypoints, len(built.mission.items), duration_s))
    return choices


def _transit_height_m(params: MissionParams, profile: VehicleProfile, needed_m: float | None) -> float:
    if params.land_transit_height_m is not None:
        return params.land_transit_height_m
    if needed_m is None:
        return profile.rtl_height_m
    # Up to the next decimetre, a whole centimetre of the height grid.
    return math.ceil(needed_m * 10) / 10 if math.isfinite(needed_m) else math.inf


def _decimated(
    path: SampledPath,
    params: MissionParams,
    profile: VehicleProfile,
    heights: Heights,
    *,
    others: int,
) -> Decimated:
    """ArduPilot counts its home row as an item."""
    limit = min(params.max_items, profile.max_items)
    room = limit - others - (1 if profile.firmware == "ardupilot" else 0)
    if room < len(path.vertex):
        raise CapacityError(
            f"The mission needs at least {limit - room + len(path.vertex)} items"
            f" ({len(path.vertex)} for its points), and the vehicle takes {limit}.",
            advice="Delete points, split the mission into several, or raise the limit if the vehicle takes more.",
        )
    climb, descent = slope_limits(path_params(profile))
    return decimate_to_fit(
        path,
        room,
        excess_height_m=params.excess_height_m,
        climb=climb,
        descent=descent,
        grid_origin_m=heights.origin_alt_dsm_m,
    )


def _holds(path: SampledPath, kept: Decimated, pois: Sequence[Poi]) -> list[float]:
    stops = zip(path.vertex, path.vertex_poi, strict=True)
    loiter_s = {int(sample): pois[poi].loiter_s for sample, poi in stops if poi is not None}
    return [loiter_s.get(int(sample), 0.0) for sample in kept.sample]


def _yaw_deg(params: MissionParams, profile: VehicleProfile) -> float:
    """PX4 takes a heading with each waypoint; ArduPilot has a command of its own."""
    if params.heading == "fixed" and profile.firmware == "px4":
        return fixed_heading_deg(params)
    return unset(profile.firmware)


def _warnings(params: MissionParams, profile: VehicleProfile, kept: Decimated) -> tuple[str, ...]:
    notes = []
    if kept.excess_height_m > params.excess_height_m:
        notes.append(
            f"The excess height was raised from {params.excess_height_m:g} m to {kept.excess_height_m:.2f} m,"
            f" so that the mission fits into {min(params.max_items, profile.max_items)} items."
        )
    if params.heading == "fixed" and profile.firmware == "ardupilot":
        notes.append("ArduCopter keeps a fixed heading beyond the next waypoint only with WP_YAW_BEHAVIOR 0.")
    return tuple(notes)
