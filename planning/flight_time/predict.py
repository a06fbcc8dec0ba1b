"""How long the vehicle will really take for a mission, with its autopilot's behaviour at waypoints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.mav_cmd import AMSL_FRAMES, HOME_FRAMES, MavCmd
from planning.basics.plan_model import Home, Mission, MissionItem, VehicleProfile
from planning.errors import MissionError
from planning.flight_time.corner_speeds import corner_leg_times
from planning.flight_time.return_speeds import ReturnPace, ReturnSpeeds, planned_pace, worse_pace
from planning.flight_time.scurve import Axes, leg, overlap_s
from planning.terrain.dsm import Dsm

VERTICAL_ACCEL_M_S2 = 1.0
"""ArduCopter's WPNAV_ACCEL_Z."""
CORNER_SHARE = 2.0
"""Corner over straight acceleration (WPNAV_ACCEL_C 0)."""
WAYPOINT_RADIUS_M = 2.0
"""WPNAV_RADIUS; PX4's NAV_ACC_RAD as well."""


@dataclass(frozen=True, slots=True)
class PredictedTime:
    """Seconds of a mission's parts."""

    total_s: float
    flight_s: float
    """First waypoint reached to last waypoint reached, holds included."""
    takeoff_s: float
    """Lift-off to first waypoint."""
    return_s: float
    """Last waypoint to touchdown."""
    per_leg_s: F64
    """(K - 1,) from waypoint reached to waypoint reached."""


@dataclass(frozen=True, slots=True)
class _Flight:
    points_m: F64
    """(K, 3) waypoints: metres east and north, height above home."""
    hold_s: F64
    speed_m_s: F64
    """(K - 1,) set speed of each leg."""
    takeoff_m: F64
    """(3,) top of the take-off"""
    transit_from: int
    """Index of the waypoint after which the way home begins."""
    lands_by_rtl: bool


def predict_duration(
    mission: Mission,
    profile: VehicleProfile,
    dsm: Dsm,
    *,
    waypoint_radius_m: float = WAYPOINT_RADIUS_M,
    returns: ReturnSpeeds | None = None,
) -> PredictedTime:
    """Predict the times of a mission of take-off, waypoints and return.

    ArduPilot: every leg is a jerk-limited S-curve from rest to rest, and the next leg may start
    while the last one brakes (``scurve``), so the speed dips at corners, stays up through straight
    waypoints of long legs, and on short legs never comes near the set speed. A waypoint with a
    hold stops the vehicle. Against a recorded ArduCopter flight of 85 waypoints 2.5 m apart the sum
    is within 0.5 % and nearly every leg within 0.05 s, with the autopilot's defaults and no fitted
    factor. PX4: speeds at corners by their angle, braking between them (``corner_speeds``);
    not checked against a flight. ``returns``: how the vehicle itself returns, None while it is only planned.
    """
    flight = _read(mission, profile, dsm)
    axes = _axes(profile)
    times = _ardupilot_legs if mission.firmware == "ardupilot" else corner_leg_times
    reached_s = times(flight.points_m, flight.hold_s, flight.speed_m_s, axes, waypoint_radius_m)
    takeoff_s = _rest_to_rest(flight.takeoff_m, axes)
    takeoff_s += _rest_to_rest(flight.points_m[0] - flight.takeoff_m, axes) + float(flight.hold_s[0])
    last = flight.transit_from
    pace = planned_pace(profile) if returns is None else worse_pace(returns, profile)
    return_s = float(reached_s[-1] - reached_s[last]) + _way_home(flight, axes, pace)
    flight_s = float(reached_s[last])
    return PredictedTime(
        total_s=takeoff_s + flight_s + return_s,
        flight_s=flight_s,
        takeoff_s=takeoff_s,
        return_s=return_s,
        per_leg_s=np.diff(reached_s[: last + 1]),
    )


def _axes(profile: VehicleProfile) -> Axes:
    return Axes(
        speed_m_s=profile.max_speed_m_s,
        climb_m_s=profile.max_climb_m_s,
        descent_m_s=profile.max_descent_m_s,
        accel_m_s2=profile.max_accel_m_s2,
        vertical_accel_m_s2=VERTICAL_ACCEL_M_S2,
        corner_accel_m_s2=CORNER_SHARE * profile.max_accel_m_s2,
        jerk_m_s3=profile.max_jerk_m_s3,
    )


def _read(mission: Mission, profile: VehicleProfile, dsm: Dsm) -> _Flight:
    """Positions in metres about home, with the hold and the set speed of each."""
    home_xy = dsm.xy_from_lat_lon(np.array([[mission.home.lat_deg, mission.home.lon_deg]]))[0]
    speed_m_s, takeoff_m = mission.cruise_speed_m_s or profile.max_speed_m_s, None
    rows, speeds = [], []
    for item in mission.items:
        if item.command == MavCmd.DO_CHANGE_SPEED and item.params[1] > 0:
            speed_m_s = item.params[1]
        elif item.command == MavCmd.NAV_TAKEOFF:
            takeoff_m = np.array([0.0, 0.0, _above_home(item, mission.home)])
        elif item.command == MavCmd.NAV_WAYPOINT:
            hold_s = item.params[0] if item.params[0] > 0 else 0.0
            rows.append((item.lat_deg, item.lon_deg, _above_home(item, mission.home), hold_s))
            speeds.append(speed_m_s)
    table = np.array(rows, dtype=np.float64).reshape(-1, 4)
    table[:, :2] = dsm.xy_from_lat_lon(table[:, :2]) - home_xy
    if not len(table) or not np.isfinite(table).all():
        raise MissionError("The mission has no waypoint whose time could be predicted.", advice="Add waypoints.")
    return _Flight(
        points_m=table[:, :3],
        hold_s=table[:, 3],
        speed_m_s=np.array(speeds[1:]),
        takeoff_m=table[0, :3] * (0, 0, 1) if takeoff_m is None else takeoff_m,
        transit_from=_last_before_return(table, mission),
        lands_by_rtl=mission.items[-1].command == MavCmd.NAV_RETURN_TO_LAUNCH,
    )


def _above_home(item: MissionItem, home: Home) -> float:
    if item.frame not in AMSL_FRAMES + HOME_FRAMES:
        raise MissionError(
            f"The duration of a mission with positions in frame {item.frame} cannot be predicted.",
            advice="Use heights relative to home.",
        )
    return item.alt_m - (home.alt_dsm_m if item.frame in AMSL_FRAMES else 0.0)


def _last_before_return(table: F64, mission: Mission) -> int:
    """A landing at home is preceded by a vertical climb and a waypoint over home; they belong to the return."""
    last = len(table) - 1
    if mission.items[-1].command != MavCmd.NAV_LAND or last < 2 or np.hypot(*table[last, :2]) > 1.0:
        return last
    climbs = np.hypot(*(table[last - 1, :2] - table[last - 2, :2])) < 0.1
    return last - 2 if climbs else last - 1


def _ardupilot_legs(points_m: F64, hold_s: F64, speed_m_s: F64, axes: Axes, radius_m: float) -> F64:
    """Seconds (K,) from the first waypoint's departure to each waypoint reached and its hold over."""
    deltas = np.diff(points_m, axis=0)
    legs = [
        leg(delta, replace(axes, speed_m_s=speed)) if np.any(np.abs(delta) > 1e-6) else None
        for delta, speed in zip(deltas, speed_m_s.tolist(), strict=True)
    ]
    reached, start_s = [0.0], 0.0
    for i, this in enumerate(legs):
        end_s = start_s + (this.duration_s if this else 0.0)
        following = legs[i + 1] if i + 1 < len(legs) else None
        joined_s = 0.0
        if this and following and hold_s[i + 1] == 0:
            joined_s = overlap_s(this, following, axes, radius_m=radius_m)
        # The autopilot counts a waypoint as passed half way through the overlap.
        reached.append(end_s - joined_s / 2 + float(hold_s[i + 1]))
        start_s = end_s - joined_s + float(hold_s[i + 1])
    return np.array(reached)


def _rest_to_rest(delta_m: F64, axes: Axes) -> float:
    return leg(delta_m, axes).duration_s if np.linalg.norm(delta_m) > 1e-6 else 0.0


def _way_home(flight: _Flight, axes: Axes, pace: ReturnPace) -> float:
    """Climb to the return height, straight home, a wait, down, and slowly for the last metres."""
    x, y, alt_m = flight.points_m[-1].tolist()
    if not flight.lands_by_rtl:
        return _rest_to_rest(np.array([x, y, 0.0]), axes) + _descent(alt_m, pace)
    axes = replace(axes, speed_m_s=pace.level_m_s, climb_m_s=pace.climb_m_s)
    # A vehicle above its return height keeps its own.
    return_m = max(alt_m, pace.height_m)
    climb_s = _rest_to_rest(np.array([0.0, 0.0, return_m - alt_m]), axes)
    return climb_s + _rest_to_rest(np.array([x, y, 0.0]), axes) + pace.wait_s + _descent(return_m, pace)


def _descent(from_m: float, pace: ReturnPace) -> float:
    slow_m = min(max(from_m, 0.0), pace.slow_below_m)
    fast_m = max(0.0, from_m - slow_m)
    return slow_m / pace.land_m_s + (fast_m / pace.descent_m_s + pace.descent_m_s / VERTICAL_ACCEL_M_S2 / 2)
