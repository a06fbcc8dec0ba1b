"""How much later than planned a flown track passes its places (Melita 2020, figs 21 and 27: the flown path lags).

The plan's clock is the predicted time of the autopilot, both clocks start at the first waypoint. The lag is
the mean, over places spread evenly along the line, of the time flown up to a place minus the time planned:
a flight that is merely delayed by d seconds has a lag of d, wherever its plan is fast or slow.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from planning.following.nearest import Deviation, Deviations
from planning.following.reference import Reference

PLACES_M = 0.5


def planned_s(reference: Reference, leg: int, share: float) -> float:
    """Predicted seconds since lift-off at a place of a leg, passed at the leg's mean speed; NaN when unknown."""
    leave_s, arrive_s = reference.leave_s[leg], reference.arrive_s[leg + 1]
    return float(leave_s + share * (arrive_s - leave_s))


def late_s(reference: Reference, at: Deviation, since_first_waypoint_s: float) -> float | None:
    """How much later than planned the vehicle is at a place, given the time since it left the first waypoint."""
    late = since_first_waypoint_s - (planned_s(reference, at.leg, at.share) - reference.takeoff_s)
    return late if math.isfinite(late) else None


def planned_alt_dsm_m(reference: Reference, since_first_waypoint_s: F64) -> F64:
    """(N,) height at which the plan's clock is then (Melita 2020, fig. 21); NaN where it has none.

    At a waypoint it stays for as long as the plan holds there.
    """
    plan_s = np.column_stack([reference.arrive_s, reference.leave_s]).ravel() - reference.takeoff_s
    alt_m = np.repeat(reference.points_m[:, 2], 2)
    known = np.isfinite(plan_s)
    if not known.any():
        return np.full(len(since_first_waypoint_s), math.nan)
    return np.interp(since_first_waypoint_s, plan_s[known], alt_m[known], left=math.nan, right=math.nan)


def lag_s(reference: Reference, t_s: F64, found: Deviations, start_s: float) -> float | None:
    """The lag of a track, whose positions (N,) lie between its first and last waypoint; None without a plan's times."""
    if len(t_s) < 2:
        return None
    places_m, plan_s = _planned(reference)
    reached_m = np.maximum.accumulate(found.s_m)
    inside = (places_m > reached_m[0]) & (places_m < reached_m[-1]) & np.isfinite(plan_s)
    if not inside.any():
        return None
    flown_s = _first_passed(reached_m, t_s, places_m[inside]) - start_s
    return float(np.mean(flown_s - plan_s[inside]))  # Melita 2020, fig. 21


def _planned(reference: Reference) -> tuple[F64, F64]:
    """Places in the middle of steps of at most ``PLACES_M``, never at a waypoint, and when they are planned."""
    parts = np.maximum(1, np.ceil(np.diff(reference.s_m) / PLACES_M)).astype(np.int64)
    leg = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(leg)) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / parts[leg]
    places_m = reference.s_m[leg] + share * np.diff(reference.s_m)[leg]
    plan_s = reference.leave_s[leg] + share * (reference.arrive_s[leg + 1] - reference.leave_s[leg])
    return places_m, plan_s - reference.takeoff_s


def _first_passed(reached_m: F64, t_s: F64, places_m: F64) -> F64:
    """When a distance that never falls first exceeds each of ``places_m``, straight between positions."""
    after = np.searchsorted(reached_m, places_m, side="right")
    before = after - 1
    share = (places_m - reached_m[before]) / (reached_m[after] - reached_m[before])
    return t_s[before] + share * (t_s[after] - t_s[before])
