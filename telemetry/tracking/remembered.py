"""What stands still and has left the radar's view is remembered until it is far, or seen to be gone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.poses import Pose
from mapping.tracker import TrackState
from planning.velocity_obstacles import Obstacles, approaches
from telemetry.tracking.followed import ENOUGH_UPDATES, Followed

WITHIN_M, FORGOTTEN_M = 15.0, 25.0
"""Only what was lost this near is remembered; beyond the other it is seen again before it matters."""
SURE_S = 0.6
"""Followed for less than that it may have been noise."""
LONGEST_S = 30.0
SAME_M = 1.0
"""A new track this near is the same thing, once it is as sure."""
SIGHT_RAD, NEAREST_M, FARTHEST_M = math.radians(30.0), 2.5, 12.0
"""Where a radar would surely see it if it were there."""
GONE_S = 1.2
"""In sight for so long without an echo it is not there."""


@dataclass(slots=True)
class _Thing:
    followed: Followed
    lost_s: float
    in_sight_s: float = 0.0


class Remembered:
    """Of one flight; ``observe`` once a frame."""

    def __init__(self) -> None:
        self._before: dict[int, Followed] = {}
        self._things: dict[int, _Thing] = {}
        self._t_s: float | None = None

    def observe(self, followed: Sequence[Followed], pose: Pose) -> list[Followed]:
        """``followed`` and what is remembered, the nearest first."""
        dt_s = 0.0 if self._t_s is None else pose.t_mono_s - self._t_s
        self._t_s = pose.t_mono_s
        now = {one.id: one for one in followed}
        for gone in self._before.keys() - now.keys():
            if _is_worth_it(self._before[gone]):
                self._things[gone] = _Thing(self._before[gone], pose.t_mono_s)
        self._before = now
        self._things = {
            key: one for key, one in self._things.items() if self._is_still_there(one, followed, pose, dt_s)
        }
        recalled = [_seen_from(one, pose) for one in self._things.values()]
        return sorted([*followed, *recalled], key=lambda one: one.range_m)

    def _is_still_there(self, thing: _Thing, followed: Sequence[Followed], pose: Pose, dt_s: float) -> bool:
        place = thing.followed.state.position_enu_m
        offset = place - pose.position_enu_m[:2]
        range_m = math.hypot(*offset)
        off_rad = abs(math.remainder(math.atan2(offset[0], offset[1]) - pose.heading_rad, math.tau))
        if off_rad <= SIGHT_RAD and NEAREST_M <= range_m <= FARTHEST_M:
            thing.in_sight_s += dt_s
        again = any(
            one.state.updates >= ENOUGH_UPDATES and np.hypot(*(one.state.position_enu_m - place)) <= SAME_M
            for one in followed
        )
        is_late = pose.t_mono_s - thing.lost_s > LONGEST_S
        return not (again or is_late or range_m > FORGOTTEN_M or thing.in_sight_s > GONE_S)


def _is_worth_it(one: Followed) -> bool:
    state = one.state
    sure = state.updates >= ENOUGH_UPDATES and state.age_s >= SURE_S
    return sure and not one.moving and not one.velocity_enu_m_s.any() and one.range_m <= WITHIN_M


def _seen_from(thing: _Thing, pose: Pose) -> Followed:
    state: TrackState = replace(thing.followed.state, velocity_enu_m_s=np.zeros(2), seen=False)
    coming = approaches(
        Obstacles.of(pose.position_enu_m[:2], [state.position_enu_m], [[0.0, 0.0]], radius_m=0.0),
        pose.velocity_enu_m_s[:2],
    )
    return Followed(
        state,
        moving=False,
        offset_m=state.position_enu_m - pose.position_enu_m[:2],
        closest_m=float(coming.closest_m[0]),
        closest_in_s=float(coming.after_s[0]),
        unseen_s=thing.followed.unseen_s + pose.t_mono_s - thing.lost_s,
        remembered=True,
    )
