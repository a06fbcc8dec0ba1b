"""A flown track, and the part of it that is judged: from the first waypoint to the last, while on the mission.

What the vehicle itself reported as reached counts where it did; elsewhere a waypoint is reached where the
track is nearest to it. A flight that left its mission ends there, and one that took it up again is judged
from where it is back on the line. What avoidance flew instead goes on with the mission: its places count,
its distances to the ground too, its deviations do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64, I64, Bools
from planning.following.nearest import Deviations
from planning.following.passing import REACHED_M, Flown, Passing, first_approach, passings
from planning.following.reference import Reference

BACK_ON_LINE_M = 1.0
"""After an interruption a position counts again once it is this near to the line, beside and above it."""

GAP_S, _GAP_STEPS = 2.0, 5.0
"""Positions that lie further apart, and so many times further than usual, have no line between them."""


@dataclass(frozen=True, slots=True)
class Track:
    """Positions as flown, one after the other."""

    t_s: F64
    """(N,) never decreasing"""
    xyz_m: F64
    """(N, 3) x, y, alt_dsm in the surface model's CRS and datum"""
    reached: tuple[tuple[float, int], ...] = ()
    """(time, index into ``Mission.items``) of what the vehicle said it reached."""
    on_mission: tuple[tuple[float, float], ...] | None = None
    """Spans of time in which it flew the mission, and not home or by hand; None: not known."""
    one_by_one: bool = False
    """Waypoints were handed over one at a time: the flight goes on to the end of its last span, not to a waypoint."""
    clock_rate: float = 1.0
    """Seconds of the vehicle's clock per second of ``t_s``: not 1 in a simulation that runs faster."""
    detours: tuple[tuple[float, float], ...] = ()
    """Spans of time in which avoidance flew what was left of the mission, mostly higher."""

    @property
    def gaps(self) -> I64:
        """(M,) rows after which nothing is known for a while: the recorder, or the vehicle, was away."""
        steps_s = np.diff(self.t_s)
        if not len(steps_s):
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(steps_s > max(GAP_S, _GAP_STEPS * float(np.median(steps_s)))).astype(np.int64)


@dataclass(frozen=True, slots=True)
class Window:
    """What of a track is judged."""

    start_s: float
    end_s: float
    judged: Bools
    """(N,) positions that count."""
    detour: Bools
    """(N,) positions on detours, between start and end as well."""
    completed: bool
    """The last waypoint was reached, or passed on a detour that left out none before it."""
    told_by: Literal["vehicle", "geometry"]
    passed: tuple[Passing, ...] = ()
    """Of a flight with detours: the mission's places, up to the first that was left out."""


def judged_window(reference: Reference, track: Track, found: Deviations) -> Window | None:
    """The part of the track from the first waypoint to the last; None when the first was never reached."""
    detour = _within(track.t_s, track.detours)
    flown = _within(track.t_s, track.on_mission) & ~detour
    begun = _start(reference, track, found, flown)
    if begun is None:
        return None
    start_s, told_by = begun
    end_s, completed = _end(reference, track, found, flown, start_s)
    passed: tuple[Passing, ...] = ()
    if detour.any():
        passed = _passed(reference, track, found, Flown(track.t_s, track.xyz_m, flown, detour), start_s)
        if not completed:
            end_s, completed = _end_on_detour(reference, track, passed, flown | detour, start_s)
    within = (track.t_s >= start_s) & (track.t_s <= end_s)
    judged = _without_ways_back(flown & within, found, track)
    return Window(start_s, end_s, judged, detour & within, completed, told_by, passed)


def _within(t_s: F64, spans: tuple[tuple[float, float], ...] | None) -> Bools:
    if spans is None:
        return np.ones(len(t_s), dtype=np.bool_)
    inside = np.zeros(len(t_s), dtype=np.bool_)
    for begin_s, end_s in spans:
        inside |= (t_s >= begin_s) & (t_s <= end_s)
    return inside


def _start(
    reference: Reference, track: Track, found: Deviations, flown: Bools
) -> tuple[float, Literal["vehicle", "geometry"]] | None:
    """When the first waypoint was reached; of a flight that was taken up in the middle, the first one it came to."""
    told = [(t, item) for t, item in track.reached if reference.first_item <= item <= reference.last_item]
    if told:
        return told[0][0], "vehicle"
    first = np.array(reference.first_m)
    at = _nearest_approach(track.xyz_m, first, flown)
    if at is None:
        near = (
            flown & (np.abs(found.cross_track_m) <= BACK_ON_LINE_M) & (np.abs(found.height_error_m) <= BACK_ON_LINE_M)
        )
        if not near.any():
            return None
        at = int(np.argmax(near))
    return float(track.t_s[at]), "geometry"


def _end(reference: Reference, track: Track, found: Deviations, flown: Bools, start_s: float) -> tuple[float, bool]:
    told = [t for t, item in track.reached if item == reference.last_item and t >= start_s]
    if told:
        return told[0], reference.whole
    far = flown & (track.t_s >= start_s) & (found.s_m >= reference.length_m - REACHED_M)
    at = _nearest_approach(track.xyz_m, reference.points_m[-1], far)
    if at is not None and not track.one_by_one:
        return float(track.t_s[at]), reference.whole
    last = np.flatnonzero(flown & (track.t_s >= start_s))
    return float(track.t_s[last[-1]]) if len(last) else start_s, at is not None and reference.whole


def _nearest_approach(xyz_m: F64, place_m: F64, among: Bools) -> int | None:
    return first_approach(np.linalg.norm(xyz_m - place_m, axis=1), among)


def _passed(reference: Reference, track: Track, found: Deviations, flown: Flown, start_s: float) -> tuple[Passing, ...]:
    row = min(int(np.searchsorted(track.t_s, start_s)), len(track.t_s) - 1)
    return passings(reference, flown, track.reached, from_s=start_s, from_line_s_m=float(found.s_m[row]))


def _end_on_detour(
    reference: Reference, track: Track, passed: tuple[Passing, ...], flown: Bools, start_s: float
) -> tuple[float, bool]:
    if passed and passed[-1].item == reference.last_item:
        return passed[-1].t_s, reference.whole
    last = np.flatnonzero(flown & (track.t_s >= start_s))
    return float(track.t_s[last[-1]]) if len(last) else start_s, False


def _without_ways_back(judged: Bools, found: Deviations, track: Track) -> Bools:
    """Takes out what was flown to come back to the line after each interruption."""
    if track.on_mission is None or len(track.on_mission) < 2:
        return judged
    kept = judged.copy()
    on_line = (np.abs(found.cross_track_m) <= BACK_ON_LINE_M) & (np.abs(found.height_error_m) <= BACK_ON_LINE_M)
    first = int(np.argmax(judged)) if judged.any() else 0
    for begin_s, end_s in track.on_mission:
        span = np.flatnonzero(judged & (track.t_s >= begin_s) & (track.t_s <= end_s))
        if len(span) and span[0] > first:
            back = np.flatnonzero(on_line[span])
            kept[span[: back[0]] if len(back) else span] = False
    return kept
