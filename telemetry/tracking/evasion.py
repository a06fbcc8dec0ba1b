"""What the tracks forbid the vehicle to do, and what it might do instead (velocity obstacles, Wessendorp 2021)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter

from mapping.geometry.arrays import F64
from mapping.geometry.poses import Pose
from mapping.perceiving.ground import GroundGrid
from planning.evading.steering import with_ground
from planning.evading.velocity_obstacles import Limits, Obstacles, Proposal, cones, propose
from telemetry.topics.tracks import VelocityCone, VelocityProposal
from telemetry.tracking.followed import Followed, Keep

DIRECTIONS, FARTHEST_M, STEP_M = 120, 40.0, 0.5
COARSE_M = 1.0
"""Cells are taken together to so much, and each counts as high as its highest neighbour: no direction misses a spike,
and what is beside the way is kept away from as well."""
MOST_CONES, MOST_EVADED = 8, 24
NEAR_RADII = 5.0
"""Objects nearer than so many safety radii are shown with their cones, whether they come nearer or not."""
SPARE = 1.25
"""A proposal keeps so many safety radii: the next frame's estimate is a little different."""
SIGMAS = 2.0
LEAST_HOLD_S = 1.0
_STOPPED_M_S, _STRAIGHT_RAD = 0.2, math.radians(2.5)
_FORBIDDEN = "Every velocity within the vehicle's limits leads into something: stop or climb."


class GroundRoom:
    """How far the vehicle may fly level in each direction before known ground comes too near; unknown is ground.

    Keeps the coarse ground of the newest surface model.
    """

    def __init__(self) -> None:
        self._of: GroundGrid | None = None
        self._top_m: F64 = np.empty((0, 0))
        self._to_cell: F64 = np.empty((2, 3))

    def around(self, ground: GroundGrid | None, position_enu_m: F64, keep_m: float) -> tuple[float, ...]:
        """(120,) metres clockwise from north, at most ``FARTHEST_M``; empty without a surface model.

        ``keep_m``: between the vehicle's middle and the ground below it.
        """
        if ground is None:
            return ()
        if ground is not self._of:
            self._take(ground)
        bearing = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
        along_m = np.arange(STEP_M, FARTHEST_M + STEP_M / 2, STEP_M)
        east = position_enu_m[0] + np.sin(bearing)[:, None] * along_m
        north = position_enu_m[1] + np.cos(bearing)[:, None] * along_m
        blocked = self._up_m(east, north) > position_enu_m[2] - keep_m
        first = np.where(blocked.any(axis=1), blocked.argmax(axis=1), len(along_m))
        return tuple((first * STEP_M).tolist())

    def _take(self, ground: GroundGrid) -> None:
        together = max(1, math.ceil(COARSE_M / ground.cell_m))
        up = np.where(np.isnan(ground.up_m), np.inf, ground.up_m).astype(np.float64)
        rows, cols = (-(-size // together) for size in up.shape)
        padded = np.full((rows * together, cols * together), np.inf)
        padded[: up.shape[0], : up.shape[1]] = up
        pooled = padded.reshape(rows, together, cols, together).max(axis=(1, 3))
        self._top_m = maximum_filter(pooled, size=3, mode="constant", cval=np.inf)
        self._to_cell = ground.enu_to_cell / together
        self._of = ground

    def _up_m(self, east: F64, north: F64) -> F64:
        cell = self._to_cell
        row = np.floor(cell[0, 0] * east + cell[0, 1] * north + cell[0, 2]).astype(np.int64)
        col = np.floor(cell[1, 0] * east + cell[1, 1] * north + cell[1, 2]).astype(np.int64)
        rows, cols = self._top_m.shape
        inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        return np.where(inside, self._top_m[np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)], np.inf)


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
