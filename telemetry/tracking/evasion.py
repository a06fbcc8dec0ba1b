"""What the tracks forbid the vehicle to do, and what it might do instead (velocity obstacles, Wessendorp 2021)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.poses import Pose
from planning.evading.steering import with_ground
from planning.evading.velocity_obstacles import Limits, Obstacles, Proposal, cones, propose
from telemetry.topics.tracks import VelocityCone, VelocityProposal
from telemetry.tracking.followed import Followed, Keep

MOST_CONES, MOST_EVADED = 8, 24
NEAR_RADII = 5.0
"""Objects nearer than so many safety radii are shown with their cones, whether they come nearer or not."""
SPARE = 1.25
"""A proposal keeps so many safety radii: the next frame's estimate is a little different."""
SIGMAS = 2.0
LEAST_HOLD_S = 1.0
_STOPPED_M_S, _STRAIGHT_RAD = 0.2, math.radians(2.5)
_FORBIDDEN = "Every velocity within the vehicle's limits leads into something: stop or climb."


@dataclass(frozen=True, slots=True)
class Evasion:
    cones: tuple[VelocityCone, ...] = ()
    proposal: VelocityProposal | None = None
    why_none: str = ""


@dataclass(frozen=True, slots=True)
class Rules:
    """What a proposal keeps to."""

    keep: Keep
    limits: Limits
    nearest_only: bool = False
    """As the paper's vehicle, which knew of no second obstacle."""
    room_m: tuple[float, ...] = ()
    """In even directions from north, clockwise, until known ground; empty: nothing is known of it."""


def evasion(followed: Sequence[Followed], pose: Pose, rules: Rules) -> Evasion:
    """``followed`` are the nearest first. Something is proposed while one of them is dangerous, moving or not."""
    keep, limits = rules.keep, rules.limits
    dangerous = [one for one in followed if one.is_dangerous(keep)]
    near = [one for one in followed if one.range_m < NEAR_RADII * _radius_m(one, keep) or one in dangerous]
    shown = tuple(_cones(near[:MOST_CONES], pose, keep))
    if not dangerous:
        return Evasion(shown)
    reach_m = limits.max_speed_m_s * keep.stands_s + keep.stands_m
    matter = [one for one in followed if one.moving or one.range_m < reach_m][:MOST_EVADED]
    obstacles = _obstacles(matter, pose, [SPARE * _radius_m(one, keep) for one in matter])
    everything = with_ground(obstacles, rules.room_m, farthest_m=reach_m)
    found = propose(everything, pose.velocity_enu_m_s[:2], limits, nearest_only=rules.nearest_only)
    if found is None:
        return Evasion(shown, None, _FORBIDDEN)
    return Evasion(shown, _proposed(found, pose))


def _radius_m(one: Followed, keep: Keep) -> float:
    """Of what stands still: with the uncertainty of its place, which of what moves lies in its velocity."""
    radius_m, _ = keep.of(moving=one.moving)
    return radius_m if one.moving else radius_m + min(SIGMAS * one.sigma_m, radius_m / 4)


def _obstacles(followed: Sequence[Followed], pose: Pose, radius_m: Sequence[float]) -> Obstacles:
    return Obstacles.of(
        pose.position_enu_m[:2],
        np.array([one.state.position_enu_m for one in followed]).reshape(-1, 2),
        np.array([one.velocity_enu_m_s for one in followed]).reshape(-1, 2),
        radius_m=np.array(radius_m),
    )


def _cones(followed: Sequence[Followed], pose: Pose, keep: Keep) -> list[VelocityCone]:
    found = cones(_obstacles(followed, pose, [_radius_m(one, keep) for one in followed]))
    return [
        VelocityCone(one.id, cone.apex_enu_m_s, math.degrees(cone.axis_rad) % 360.0, math.degrees(cone.half_angle_rad))
        for one, cone in zip(followed, found, strict=True)
    ]


def _proposed(found: Proposal, pose: Pose) -> VelocityProposal:
    return VelocityProposal(
        found.velocity_enu_m_s, max(LEAST_HOLD_S, found.hold_s), found.closest_m, words(found, pose)
    )


def words(found: Proposal, pose: Pose) -> str:
    """For the pilot: "Turn 25 deg left, 4.2 m/s"."""
    speed = math.hypot(*found.velocity_enu_m_s)
    if speed < _STOPPED_M_S:
        return "Stop"
    if math.hypot(*pose.velocity_enu_m_s[:2]) < _STOPPED_M_S:
        return f"Fly {math.degrees(math.atan2(*found.velocity_enu_m_s)) % 360:.0f} deg, {speed:.1f} m/s"
    if abs(found.turn_rad) < _STRAIGHT_RAD:
        return f"Straight on, {speed:.1f} m/s"
    side = "right" if found.turn_rad > 0 else "left"
    return f"Turn {math.degrees(abs(found.turn_rad)):.0f} deg {side}, {speed:.1f} m/s"
