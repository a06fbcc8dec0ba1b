"""What of a plan the autopilot's settings have to suit."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mapping.geometry.frames import apart_m
from planning.basics.mav_cmd import AMSL_FRAMES, TERRAIN_FRAMES
from planning.basics.plan_model import Mission
from planning.certificate.commands import STRAIGHT, TAKEOFFS
from planning.missions.feasibility import commanded_speed_m_s

SPHERE_ERROR = 1.006
"""Distances on the sphere are off by at most that."""


@dataclass(frozen=True, slots=True)
class LowPlan:
    highest_m: float | None
    """Above home; None where a height counts from the ground or home's own is not known."""
    lowest_m: float | None
    farthest_m: float
    """From home, on the level."""
    speed_m_s: float
    """The fastest that was planned."""
    commands_speed: bool
    """By its own items; otherwise the vehicle flies as fast as it is set."""
    over_terrain: bool
    """Some heights count from the vehicle's own terrain data."""
    return_needed_m: float | None = None
    """Height above home at which the way home is clear from everywhere; None: not computed."""


def low_plan(mission: Mission, *, speed_m_s: float, return_needed_m: float | None = None) -> LowPlan:
    """``speed_m_s`` of the plan, should its items command none; ``return_needed_m`` of its certificate."""
    placed = [item for item in mission.items if item.command in STRAIGHT | TAKEOFFS]
    home = mission.home
    heights = [i.alt_m - home.alt_dsm_m if i.frame in AMSL_FRAMES else i.alt_m for i in placed]
    over_terrain = any(item.frame in TERRAIN_FRAMES for item in placed)
    known = bool(heights) and not over_terrain and all(map(math.isfinite, heights))
    commanded = commanded_speed_m_s(mission)
    origin_deg = home.lat_deg, home.lon_deg
    away = [apart_m(origin_deg, (i.lat_deg, i.lon_deg)) for i in placed if i.command not in TAKEOFFS]
    return LowPlan(
        highest_m=max(heights) if known else None,
        lowest_m=min(heights) if known else None,
        farthest_m=SPHERE_ERROR * max(away, default=0.0),
        speed_m_s=speed_m_s if commanded is None else commanded,
        commands_speed=commanded is not None,
        over_terrain=over_terrain,
        return_needed_m=return_needed_m,
    )
