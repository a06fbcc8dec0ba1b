"""What a flown track came to against its plan and over the surface model, in numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64, I64, Bools
from planning.following.lag import lag_s, planned_s
from planning.following.nearest import Deviations, follow_track
from planning.following.passing import LOWER_M, REACHED_M, Passing
from planning.following.reference import Reference
from planning.following.surface_distance import SurfaceDistance
from planning.following.track import Track, Window, judged_window

AT_HOME_M = 3.0
"""The way home ends this far from home: there the vehicle comes down to the ground."""
BINS = 20
FINEST_BIN_M = 0.01


@dataclass(frozen=True, slots=True)
class Spread:
    """Of the sizes of an error over all positions that count."""

    max_m: float
    mean_m: float
    p95_m: float


@dataclass(frozen=True, slots=True)
class NearestToSurface:
    """Where a track came nearest to the surface model."""

    distance_m: float
    t_s: float
    s_m: float
    """Of the place of the planned line that belongs to it."""
    xyz_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Higher:
    """Places that avoidance passed above the plan."""

    most_m: float
    from_item: int
    """Index into ``Mission.items`` of the first of them."""


@dataclass(frozen=True, slots=True)
class TrackFigures:
    """All figures of one flight. Distances are None without a surface model, or where it knows nothing."""

    start_s: float
    end_s: float
    completed: bool
    higher: Higher | None
    told_by: Literal["vehicle", "geometry"]
    positions: int
    flight_s: float
    """By the vehicle's clock, as the lag is; all other times are the track's."""
    predicted_s: float | None
    lag_s: float | None
    cross_track: Spread
    height: Spread
    height_lowest_m: float
    height_highest_m: float
    nearest: NearestToSurface | None
    min_vertical_m: float | None
    nearest_on_way_home: NearestToSurface | None
    came_home: bool
    """Whether the way home led to home."""
    unknown_positions: int
    """Positions of those that count below which the surface model knows nothing."""
    histogram_edges_m: F64
    histogram_counts: I64


@dataclass(frozen=True, slots=True)
class Judged:
    """A track held against its reference: curves for every position, and figures where there are any."""

    found: Deviations
    window: Window | None
    """None: the track never came to the line."""
    distance_m: F64 | None
    """(N,) to the surface model; NaN where unknown. None without a model."""
    height_m: F64 | None
    """(N,) above the cell below."""
    figures: TrackFigures | None


def judge(reference: Reference, track: Track, surface: SurfaceDistance | None) -> Judged:
    """Hold a track against its reference line and, if there is one, the surface model.

    Errors and distances count from the first waypoint reached to the last; the way home counts from there
    until ``AT_HOME_M`` from home.
    """
    found = follow_track(reference, track.xyz_m)
    window = judged_window(reference, track, found)
    distance_m = surface.distances_m(track.xyz_m) if surface else None
    height_m = surface.heights_m(track.xyz_m) if surface else None
    figures = _figures(reference, track, found, window, distance_m, height_m) if window else None
    return Judged(found, window, distance_m, height_m, figures)


def _figures(
    reference: Reference,
    track: Track,
    found: Deviations,
    window: Window,
    distance_m: F64 | None,
    height_m: F64 | None,
) -> TrackFigures | None:
    if not window.judged.any():
        return None
    on_line = _part(found, window.judged)
    size_m, above_m = np.abs(on_line.cross_track_m), on_line.height_error_m
    home, rate = _way_home(reference, track, window), track.clock_rate
    edges_m, counts = _histogram(size_m)
    gone_s = _gone_s(reference, on_line)
    below = None if height_m is None else height_m[window.judged]
    near_ground = window.judged | window.detour
    return TrackFigures(
        start_s=window.start_s,
        end_s=window.end_s,
        completed=window.completed,
        higher=_higher(window.passed),
        told_by=window.told_by,
        positions=int(window.judged.sum()),
        flight_s=rate * (window.end_s - window.start_s),
        predicted_s=reference.flight_s - gone_s if math.isfinite(reference.flight_s) else None,
        lag_s=lag_s(reference, rate * track.t_s[window.judged], on_line, rate * window.start_s - gone_s),
        cross_track=_spread(size_m),
        height=_spread(np.abs(above_m)),
        height_lowest_m=float(above_m.min()),
        height_highest_m=float(above_m.max()),
        nearest=_nearest(track, found, near_ground, distance_m),
        min_vertical_m=_smallest(height_m, near_ground),
        nearest_on_way_home=_nearest(track, found, home, distance_m),
        came_home=_came_home(reference, track, window),
        unknown_positions=0 if below is None else int(np.isnan(below).sum()),
        histogram_edges_m=edges_m,
        histogram_counts=counts,
    )


def _higher(passed: tuple[Passing, ...]) -> Higher | None:
    above = [place for place in passed if place.higher_m > LOWER_M]
    return Higher(max(place.higher_m for place in above), above[0].item) if above else None


def _gone_s(reference: Reference, on_line: Deviations) -> float:
    """Planned time before the place where a flight began that was taken up in the middle: it is on time there."""
    if on_line.s_m[0] <= REACHED_M:
        return 0.0
    gone_s = planned_s(reference, int(on_line.leg[0]), float(on_line.share[0])) - reference.takeoff_s
    return gone_s if math.isfinite(gone_s) else 0.0


def _part(found: Deviations, chosen: Bools) -> Deviations:
    return Deviations(
        found.s_m[chosen],
        found.cross_track_m[chosen],
        found.height_error_m[chosen],
        found.leg[chosen],
        found.share[chosen],
    )


def _spread(size_m: F64) -> Spread:
    return Spread(float(size_m.max()), float(size_m.mean()), float(np.percentile(size_m, 95)))


def _way_home(reference: Reference, track: Track, window: Window) -> Bools:
    """Positions after the last waypoint, until the vehicle has once been over home."""
    away_m = np.hypot(*(track.xyz_m[:, :2] - reference.home_xy_m).T)
    after = track.t_s > window.end_s
    there = np.flatnonzero(after & (away_m <= AT_HOME_M))
    before_landing = np.arange(len(away_m)) < (there[0] if len(there) else len(away_m))
    return after & before_landing


def _came_home(reference: Reference, track: Track, window: Window) -> bool:
    away_m = np.hypot(*(track.xyz_m[:, :2] - reference.home_xy_m).T)
    return bool(((track.t_s > window.end_s) & (away_m <= AT_HOME_M)).any())


def _nearest(track: Track, found: Deviations, chosen: Bools, distance_m: F64 | None) -> NearestToSurface | None:
    if distance_m is None:
        return None
    among = np.where(chosen & np.isfinite(distance_m), distance_m, np.inf)
    if not len(among) or not np.isfinite(among.min()):
        return None
    at = int(np.argmin(among))
    x, y, z = (float(v) for v in track.xyz_m[at])
    return NearestToSurface(float(distance_m[at]), float(track.t_s[at]), float(found.s_m[at]), (x, y, z))


def _smallest(values_m: F64 | None, chosen: Bools) -> float | None:
    if values_m is None or not np.isfinite(values_m[chosen]).any():
        return None
    return float(np.nanmin(values_m[chosen]))


def _histogram(size_m: F64) -> tuple[F64, I64]:
    """Counts between 0 and the largest error, in ``BINS`` bins of a round width."""
    width_m = _round_up(max(float(size_m.max()) / BINS, FINEST_BIN_M))
    bins = max(1, math.ceil(float(size_m.max()) / width_m - 1e-9))
    edges_m: F64 = width_m * np.arange(bins + 1, dtype=np.float64)
    edges_m[-1] = max(edges_m[-1], float(size_m.max()))
    counts, _ = np.histogram(size_m, bins=edges_m)  # Melita 2020, fig. 23
    return edges_m, counts.astype(np.int64)


def _round_up(width_m: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(width_m))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= width_m * (1 - 1e-9))
