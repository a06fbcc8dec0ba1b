"""A path becomes mission items: few straight legs that are nowhere below it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planning.climb import slope_limits
from planning.decimate import Decimated, decimate_to_fit
from planning.dsm import Dsm, is_amsl
from planning.errors import CapacityError, DatumError, MissionError, ParameterError
from planning.mission_items import (
    Heights,
    closing_actions,
    ending,
    opening_actions,
    takeoff,
    waypoint,
)
from planning.model import Home, Mission, MissionItem, MissionParams, PathParams, Poi, SampledPath, VehicleProfile
from planning.vehicle_profile import path_params as limits_of

HOME_TOLERANCE_M = 0.5


def build_mission(
    path: SampledPath,
    home: Home,
    params: MissionParams,
    profile: VehicleProfile,
    dsm: Dsm,
    pois: Sequence[Poi],
    *,
    path_params: PathParams | None = None,
    rtl_height_needed_m: float | None = None,
) -> Mission:
    """The mission along ``path``, which starts over home.

    Speed, vertical take-off, waypoints (one for each vertex, between them as few as
    ``params.excess_height_m`` allows; that is raised, with a warning, when the items would be more than
    the vehicle takes), loiter, heading, gimbal and camera, return. ``path_params`` (default: from the
    profile) hold the speeds; ``rtl_height_needed_m`` is the transit height of a landing at home
    where ``params`` give none. Raises ``CapacityError``, ``DatumError``, ``MissionError``.
    """
    speeds = path_params or limits_of(profile)
    heights = _heights(home, params)
    _check_start(path, home, dsm)
    opening = opening_actions(params, profile.firmware, heights, dsm, speeds.max_speed_m_s)
    ends = [*closing_actions(params), *ending(params, home, heights, _Transit(path, dsm), rtl_height_needed_m)]
    room = _room(params, profile, others=len(opening) + 1 + len(ends))
    climb, descent = slope_limits(speeds)
    kept = decimate_to_fit(
        path,
        room,
        excess_height_m=params.excess_height_m,
        climb=climb,
        descent=descent,
        grid_origin_m=heights.origin_alt_dsm_m,
    )
    points = _waypoints(path, kept, params, profile, heights, dsm, pois)
    items = [opening[0], takeoff(home, heights, points[0].alt_m), points[0], *opening[1:], *points[1:], *ends]
    return Mission(
        home=home,
        items=tuple(items),
        firmware=profile.firmware,
        pois=tuple(pois),
        cruise_speed_m_s=speeds.max_speed_m_s,
        warnings=_warnings(params, profile, kept),
    )
