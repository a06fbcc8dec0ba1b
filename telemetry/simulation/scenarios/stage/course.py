"""A flight as places in east, north, up of home, and as the targets of the navigation script that flies them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import Home, Mission, MissionItem
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.requests import Operator, StartGuided

OPERATOR = Operator("scenario", 1)
DATUM = "EGM2008 height"


@dataclass(frozen=True, slots=True)
class Waypoint:
    enu_m: tuple[float, float, float]
    """Up counts from home."""
    speed_m_s: float
    heading_rad: float | None = None
    """Clockwise from north; None: nose along the way."""
    loiter_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Course:
    waypoints: tuple[Waypoint, ...]
    takeoff_m: float
    end: Literal["rtl", "land"] = "rtl"


def script_request(course: Course, frame: NeuFrame) -> StartGuided:
    """What the operator would ask of the link to have the course flown."""
    return StartGuided(
        OPERATOR, guided_targets(course.waypoints, frame), course.takeoff_m, waypoint_radius_m=0.5, end=course.end
    )


def guided_targets(waypoints: Sequence[Waypoint], frame: NeuFrame) -> tuple[GuidedTarget, ...]:
    """Numbered from 2, as behind a mission's take-off."""
    return tuple(_target(number, waypoint, frame) for number, waypoint in enumerate(waypoints, start=2))


def _target(number: int, waypoint: Waypoint, frame: NeuFrame) -> GuidedTarget:
    east, north, up = waypoint.enu_m
    lat_deg, lon_deg, _ = frame.geodetic_from_neu((north, east, up))
    return GuidedTarget(
        number,
        lat_deg,
        lon_deg,
        up,
        waypoint.speed_m_s,
        loiter_s=waypoint.loiter_s,
        heading_rad=waypoint.heading_rad,
    )


def course_mission(course: Course, frame: NeuFrame) -> Mission:
    """The course for AUTO; headings and waits are the script's alone."""
    items = [_item(MavCmd.NAV_TAKEOFF, 0.0, 0.0, course.takeoff_m)]
    speed_m_s = math.nan
    for target in guided_targets(course.waypoints, frame):
        if target.speed_m_s != speed_m_s:
            speed_m_s = target.speed_m_s
            items.append(
                MissionItem(MavCmd.DO_CHANGE_SPEED, MavFrame.MISSION, (1.0, speed_m_s, -1.0, 0.0), 0.0, 0.0, 0.0)
            )
        items.append(_item(MavCmd.NAV_WAYPOINT, target.lat_deg, target.lon_deg, target.alt_rel_home_m))
    items.append(_item(MavCmd.NAV_RETURN_TO_LAUNCH if course.end == "rtl" else MavCmd.NAV_LAND, 0.0, 0.0, 0.0))
    home = Home(frame.lat_deg, frame.lon_deg, frame.alt_amsl_m, DATUM)
    return Mission(home, tuple(items), cruise_speed_m_s=course.waypoints[0].speed_m_s)


def _item(command: int, lat_deg: float, lon_deg: float, up_m: float) -> MissionItem:
    return MissionItem(command, MavFrame.GLOBAL_RELATIVE_ALT, (0.0, 0.0, 0.0, 0.0), lat_deg, lon_deg, up_m)
