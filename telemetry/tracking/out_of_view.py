"""What has left the radar's view is remembered until it is far or seen to be gone: unseen is not clear."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.poses import Pose
from mapping.tracking.tracker_params import TrackState
from planning.evading.velocity_obstacles import Obstacles, approaches
from telemetry.tracking.followed import ENOUGH_UPDATES, Followed

WITHIN_M, FORGOTTEN_M = 15.0, 25.0
"""Only what was lost this near is remembered; beyond the other it is seen again before it matters."""
SURE_S = 0.6
"""Followed for less than that it may have been noise."""
LONGEST_S, LONGEST_MOVING_S = 30.0, 10.0
"""What moves goes on as it did, and is known worse with every second."""
SAME_M, SAME_MOVING_M = 1.0, 3.0
"""A new track this near is the same thing, once it is as sure."""
SIGHT_RAD, NEAREST_M, FARTHEST_M = math.radians(30.0), 2.5, 12.0
"""Where a radar would surely see it if it were there."""
GONE_S = 1.2
"""In sight for so long without an echo it is not there."""


@dataclass(slots=True)
class _Thing:
    followed: Followed
    """As it was in the last frame that had it."""
    lost_s: float
    """When that was."""
    in_sight_s: float = 0.0


class Remembered:
    """Of one flight; ``observe`` once a frame."""

    def __init__(self) -> None:
        self._before: dict[int, Followed] = {}
        self._things: dict[int, _Thing] = {}
        self._t_s: float | None = None

    def observe(self, followed: Sequence[Followed], pose: Pose) -> list[Followed]:
        """``followed`` and what is remembered, the nearest first."""
        before_s = pose.t_mono_s if self._t_s is None else self._t_s
        self._t_s = pose.t_mono_s
        now = {one.id: one for one in followed}
        for gone in self._before.keys() - now.keys():
            if _is_worth_it(self._before[gone], pose):
                self._things[gone] = _Thing(self._before[gone], before_s)
        self._before = now
        self._things = {
            key: one
            for key, one in self._things.items()
            if self._is_still_there(one, followed, pose, pose.t_mono_s - before_s)
        }
        recalled = [_seen_from(one, pose) for one in self._things.values()]
        return sorted([*followed, *recalled], key=lambda one: one.range_m)

    def _is_still_there(self, thing: _Thing, followed: Sequence[Followed], pose: Pose, dt_s: float) -> bool:
        late_s, moving = pose.t_mono_s - thing.lost_s, thing.followed.moving
        place = _later(thing.followed, late_s).position_enu_m
        if _is_in_sight(place, pose):
            thing.in_sight_s += dt_s
        same_m = SAME_MOVING_M if moving else SAME_M
        again = any(
            one.state.updates >= ENOUGH_UPDATES and np.hypot(*(one.state.position_enu_m - place)) <= same_m
            for one in followed
        )
        is_late = late_s > (LONGEST_MOVING_S if moving else LONGEST_S)
        is_far = not moving and math.hypot(*(place - pose.position_enu_m[:2])) > FORGOTTEN_M
        return not (again or is_late or is_far or thing.in_sight_s > GONE_S)


def _is_worth_it(one: Followed, pose: Pose) -> bool:
    """What was lost in plain sight may have been noise; what cannot be seen where it is, is there."""
    state, is_hidden = one.state, _is_hidden(one.state.position_enu_m, pose)
    if one.moving:
        return is_hidden and state.updates >= ENOUGH_UPDATES
    if one.range_m > WITHIN_M:
        return False
    sure = state.updates >= ENOUGH_UPDATES and state.age_s >= SURE_S and not one.goes
    return sure or is_hidden


def _is_in_sight(place_enu_m: F64, pose: Pose) -> bool:
    return not _is_hidden(place_enu_m, pose) and math.hypot(*(place_enu_m - pose.position_enu_m[:2])) <= FARTHEST_M


def _is_hidden(place_enu_m: F64, pose: Pose) -> bool:
    """Too near, or too far beside the nose."""
    offset = place_enu_m - pose.position_enu_m[:2]
    off_rad = abs(math.remainder(math.atan2(offset[0], offset[1]) - pose.heading_rad, math.tau))
    return math.hypot(*offset) < NEAREST_M or off_rad > SIGHT_RAD


def _later(one: Followed, later_s: float) -> TrackState:
    """What stands is where it was; what moves has gone on, and its place is known worse by its speed's uncertainty."""
    state, carry = one.state, np.eye(4)
    if not one.moving:
        return replace(state, velocity_enu_m_s=np.zeros(2), seen=False)
    carry[0, 2] = carry[1, 3] = later_s
    place = state.position_enu_m + later_s * np.asarray(state.velocity_enu_m_s)
    return replace(state, position_enu_m=place, covariance=carry @ state.covariance @ carry.T, seen=False)


def _seen_from(thing: _Thing, pose: Pose) -> Followed:
    one, later_s = thing.followed, pose.t_mono_s - thing.lost_s
    state = _later(one, later_s)
    offset = state.position_enu_m - pose.position_enu_m[:2]
    coming = approaches(
        Obstacles.of([0.0, 0.0], [offset], [state.velocity_enu_m_s], radius_m=0.0), pose.velocity_enu_m_s[:2]
    )
    return Followed(
        state,
        moving=one.moving,
        offset_m=offset,
        closest_m=float(coming.closest_m[0]),
        closest_in_s=float(coming.after_s[0]),
        unseen_s=one.unseen_s + later_s,
        remembered=True,
        goes=one.moving,
    )
