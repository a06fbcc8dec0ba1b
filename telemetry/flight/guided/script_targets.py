"""A planned mission as the targets of the navigation script (Melita 2020, section 7), with the plan's timing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from planning.basics.mav_cmd import MavCmd, MavFrame
from planning.basics.plan_model import Mission, MissionItem
from planning.certificate.commands import BENT, OTHER_UNJUDGED, TAKEOFFS
from planning.errors import MissionError
from planning.formats.commands import plain_frame
from planning.formats.trajectory_csv import Trajectory
from planning.terrain.vertical_datum import is_amsl
from telemetry.topics.messages import GuidedTarget

GROUND_SPEEDS = (0, 1)
DEFAULT_SPEED_M_S = 3.0
PRESENT_HEIGHT_M = 0.01
"""ArduPilot takes a height that it stores as 0 cm for the present one."""
LEVEL_LEG_M = 1.0
"""A shorter leg over ground has no direction that the nose should turn to."""


@dataclass(frozen=True, slots=True)
class GuidedPlan:
    """What ``StartGuided`` asks for, but for the operator."""

    targets: tuple[GuidedTarget, ...]
    takeoff_alt_rel_home_m: float
    end: Literal["rtl", "land"]


def guided_plan(mission: Mission, *, speed_m_s: float | None = None) -> GuidedPlan:
    """A mission for the navigation script; ``speed_m_s``: where no item sets one.

    Raises MissionError for items that it cannot fly.
    """
    reader = _Reader(mission, speed_m_s or mission.cruise_speed_m_s or DEFAULT_SPEED_M_S)
    for number, item in enumerate(mission.items, start=1):
        if reader.end is None:
            reader.read(number, item)
    if not reader.targets:
        raise MissionError("The mission has no waypoint to hand over.", advice="Plan at least one waypoint.")
    takeoff_m = reader.takeoff_m if reader.takeoff_m is not None else reader.targets[0].alt_rel_home_m
    return GuidedPlan(tuple(reader.targets), takeoff_m, reader.end or "rtl")


def with_timing(targets: Sequence[GuidedTarget], trajectory: Trajectory) -> tuple[GuidedTarget, ...]:
    """Each target with the time at which the paper's law reaches it, counted from the first target."""
    lat_lon_deg = trajectory.lat_lon_deg
    left_s = np.concatenate([[0.0], np.cumsum(trajectory.time_to_next_s[:-1] + trajectory.loiter_s[:-1])])
    sample, timed = 0, []
    for target in targets:
        sample += _nearest(lat_lon_deg[sample:], target)
        timed.append(float(left_s[sample]))
    return tuple(replace(target, t_s=reached_s - timed[0]) for target, reached_s in zip(targets, timed, strict=True))


def _nearest(lat_lon_deg: F64, target: GuidedTarget) -> int:
    """Index of the first sample of the nearest pass over the target: a route may come by again later."""
    away_m = np.hypot(*offset_m((target.lat_deg, target.lon_deg), lat_lon_deg[:, 0], lat_lon_deg[:, 1]))
    near = np.flatnonzero(away_m <= away_m.min() + 0.05)
    return int(near[0])


def bearing_rad(start_deg: tuple[float, float], end_deg: tuple[float, float]) -> float | None:
    """From one latitude and longitude to another; None where they are too near each other to have a direction."""
    east_m, north_m = offset_m(start_deg, *end_deg)
    return None if math.hypot(north_m, east_m) < LEVEL_LEG_M else math.atan2(east_m, north_m) % math.tau


class _Reader:
    """Goes through the items with what earlier ones have set."""

    def __init__(self, mission: Mission, speed_m_s: float) -> None:
        self._home, self._ardupilot = mission.home, mission.firmware == "ardupilot"
        self._speed_m_s = speed_m_s
        self._heading_rad: float | None = None
        self._look_at: tuple[float, float] | None = None
        self.targets: list[GuidedTarget] = []
        self.takeoff_m: float | None = None
        self.end: Literal["rtl", "land"] | None = None

    def read(self, number: int, item: MissionItem) -> None:
        if item.command in TAKEOFFS:
            self.takeoff_m = self._height(number, item)
        elif item.command in (MavCmd.NAV_WAYPOINT, MavCmd.NAV_LOITER_TIME):
            self._target(number, item)
        elif item.command == MavCmd.NAV_RETURN_TO_LAUNCH:
            self.end = "rtl"
        elif item.command == MavCmd.NAV_LAND:
            self._land(number, item)
        elif item.command in BENT or item.command in OTHER_UNJUDGED or item.command == MavCmd.NAV_LOITER_UNLIM:
            why = BENT.get(item.command) or OTHER_UNJUDGED.get(item.command) or "waits without end"
            raise MissionError(
                f"The navigation script cannot fly it: command {item.command} {why}.",
                where=f"item {number}",
                advice="Fly this mission in AUTO, or plan it with waypoints only.",
            )
        else:
            self._set(item)

    def _set(self, item: MissionItem) -> None:
        p1, p2, _, relative = item.params
        if item.command == MavCmd.DO_CHANGE_SPEED and p1 in GROUND_SPEEDS and p2 > 0:
            self._speed_m_s = p2
        elif item.command == MavCmd.CONDITION_YAW and relative != 1:
            self._heading_rad = math.radians(p1) % math.tau
        elif item.command in (MavCmd.DO_SET_ROI_LOCATION, MavCmd.DO_SET_ROI):
            self._look_at = (item.lat_deg, item.lon_deg)
        elif item.command == MavCmd.DO_SET_ROI_NONE:
            self._look_at = None

    def _target(self, number: int, item: MissionItem) -> None:
        lat_deg, lon_deg = self._place(item)
        wait_s, yaw_deg = item.params[0], item.params[3]
        self.targets.append(
            GuidedTarget(
                item=number,
                lat_deg=lat_deg,
                lon_deg=lon_deg,
                alt_rel_home_m=self._height(number, item),
                speed_m_s=self._speed_m_s,
                loiter_s=wait_s if math.isfinite(wait_s) and wait_s > 0 else 0.0,
                heading_rad=self._heading(lat_deg, lon_deg, yaw_deg),
            )
        )

    def _land(self, number: int, item: MissionItem) -> None:
        self.end = "land"
        place = self._place(item)
        if self.targets and place != (self.targets[-1].lat_deg, self.targets[-1].lon_deg):
            lat_deg, lon_deg = place
            self.targets.append(replace(self.targets[-1], item=number, lat_deg=lat_deg, lon_deg=lon_deg, loiter_s=0.0))

    def _place(self, item: MissionItem) -> tuple[float, float]:
        given = not (math.isnan(item.lat_deg) or math.isnan(item.lon_deg)) and (item.lat_deg or item.lon_deg)
        if given:
            return item.lat_deg, item.lon_deg
        if self.targets:
            return self.targets[-1].lat_deg, self.targets[-1].lon_deg
        return self._home.lat_deg, self._home.lon_deg

    def _height(self, number: int, item: MissionItem) -> float:
        if self._ardupilot and abs(item.alt_m) < PRESENT_HEIGHT_M and self.targets:
            return self.targets[-1].alt_rel_home_m
        frame = plain_frame(item.frame)
        if frame == MavFrame.GLOBAL_RELATIVE_ALT and math.isfinite(item.alt_m):
            return item.alt_m
        if frame == MavFrame.GLOBAL and is_amsl(self._home.vertical_datum):
            height_m = item.alt_m - self._home.alt_dsm_m
            if math.isfinite(height_m):
                return height_m
        raise MissionError(
            f"Its height above home is not known (altitude {item.alt_m:g} m, frame {item.frame}).",
            where=f"item {number}",
            advice="Plan with heights above home.",
        )

    def _heading(self, lat_deg: float, lon_deg: float, yaw_deg: float) -> float | None:
        if self._look_at is not None:
            return math.atan2(*offset_m((lat_deg, lon_deg), *self._look_at)) % math.tau
        if not self._ardupilot and math.isfinite(yaw_deg):
            return math.radians(yaw_deg) % math.tau
        return self._heading_rad
