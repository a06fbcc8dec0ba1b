"""A flight followed while it is flown: progress, time left and delay, position by position."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from planning.following.lag import late_s, planned_s
from planning.following.nearest import Deviation, follow
from planning.following.passing import REACHED_M
from planning.following.reference import Reference


@dataclass(frozen=True, slots=True)
class Following:
    """What is remembered from one position to the next; begin with ``Following()`` at every start."""

    at: Deviation | None = None
    first_waypoint_s: float | None = None
    """When the vehicle left the first waypoint; when it should have, if it came to the line elsewhere."""
    begun: bool = False
    """Whether the line was reached: before that the vehicle is still on its way to it."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a flight stands; None where the plan has no times."""

    share: float
    """Of the planned line's length, 0 to 1."""
    time_left_s: float | None
    """To the landing, as predicted."""
    behind_plan_s: float | None
    """Later (positive) than predicted, counted from the first waypoint."""


def follow_on(
    before: Following, reference: Reference, xyz_m: tuple[float, float, float], t_s: float
) -> tuple[Following, Progress]:
    """The next position (x, y, alt_dsm) at ``t_s`` of a flight that is under way."""
    at = follow(reference, xyz_m, near_s_m=before.at.s_m if before.at and before.begun else None)
    now = replace(before, at=at)
    at_first = math.dist(xyz_m, reference.first_m) <= REACHED_M and at.s_m <= REACHED_M
    if at_first or (not before.begun and math.hypot(at.cross_track_m, at.height_error_m) <= REACHED_M):
        # On time here, be it at the first waypoint or where a flight is taken up again.
        gone_s = planned_s(reference, at.leg, at.share) - reference.takeoff_s
        now = replace(now, first_waypoint_s=t_s - gone_s if math.isfinite(gone_s) else None, begun=True)
    return now, _progress(reference, now, t_s)


def _progress(reference: Reference, now: Following, t_s: float) -> Progress:
    assert now.at is not None
    share = now.at.s_m / reference.length_m if reference.length_m > 0 else 1.0
    if not now.begun:
        left_s = reference.total_s
        return Progress(0.0, left_s if math.isfinite(left_s) else None, None)
    left_s = reference.total_s - planned_s(reference, now.at.leg, now.at.share)
    behind_s = None
    if now.first_waypoint_s is not None:
        behind_s = late_s(reference, now.at, t_s - now.first_waypoint_s)
    return Progress(share, left_s if math.isfinite(left_s) else None, behind_s)
