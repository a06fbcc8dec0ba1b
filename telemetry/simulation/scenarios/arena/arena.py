"""Scenario: past two poles in a hall by a Position2Go, flown by what avoids in flight (Wessendorp 2021, figs 5-8)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.errors import ParameterError
from telemetry.simulation.scenarios.arena.against_truth import rms
from telemetry.simulation.scenarios.arena.arena_course import (
    HALF_M,
    POLE_RADIUS_M,
    VEHICLE_RADIUS_M,
    Approach,
    approaches,
)
from telemetry.simulation.scenarios.arena.arena_flight import ArenaFlown, arena_settings, fly
from telemetry.simulation.scenarios.stage.result import (
    AlertSeen,
    Figure,
    FlightResult,
    ScenarioRequest,
    ScenarioResult,
)
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, series
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import with_figures

NAME = "arena"
AVOIDED, THROUGH = 1.0, 0.98
FAR_DEG = tuple(range(0, 40, 5))
"""Off the nose: the steps of the table of errors."""
LEAST_SAMPLES = 30
Errors = Sequence[tuple[float, float, float]]
"""Of tracked poles in view: off the nose (rad), error of range (m), error of bearing (rad)."""


def run(wanted: ScenarioRequest) -> ScenarioResult:
    """26 ways as the paper's vehicle flew them, past the nearest obstacle only, and 78 past all of them.

    Raises ParameterError for a world or a recording of one's own: the hall has a vehicle of its own.
    """
    for name, value in (("--world", wanted.world), ("--record", wanted.record)):
        if value is not None:
            raise ParameterError("The arena has poles of its own and is not recorded.", where=name, advice="Leave it.")
    return ScenarioResult(
        NAME,
        wanted.seed,
        (
            through(
                "nearest obstacle only", 26, np.random.default_rng([wanted.seed, 6]), nearest_only=True, wanted=wanted
            ),
            through("all obstacles", 78, np.random.default_rng([wanted.seed, 5]), nearest_only=False, wanted=wanted),
        ),
    )


def through(
    title: str, count: int, random: np.random.Generator, *, nearest_only: bool, wanted: ScenarioRequest | None = None
) -> FlightResult:
    """So many ways from all around."""
    wanted = wanted or ScenarioRequest()
    settings = _settings(wanted, nearest_only=nearest_only)
    ways = approaches(count, random)
    flown: list[ArenaFlown] = []
    for way in ways:
        wanted.report(f"{title}, way {len(flown) + 1} of {count}", len(flown) / count)
        flown.append(fly(way, random, settings=settings, radar=wanted.radar or "model"))
    contacts = [one.nearest_gap_m <= 0.0 for one in flown]
    return FlightResult(
        title=f"{count} approaches, {title}",
        duration_s=sum(one.duration_s for one in flown),
        contact=any(contacts),
        min_true_distance_m=min(one.nearest_gap_m for one in flown),
        alerts=_alerts(flown),
        figures=_figures(title, ways, flown, "all 26 (fig. 6)" if nearest_only else "78 by a pilot (fig. 5)"),
        notes=_errors_by_angle([error for one in flown for error in one.errors]),
        charts=(ways_chart(title, ways, flown), *error_charts([error for one in flown for error in one.errors])),
    )


def _settings(wanted: ScenarioRequest, *, nearest_only: bool) -> PerceptionSettings:
    usual = arena_settings(nearest_only=nearest_only)
    return replace(
        usual,
        tracker=with_figures(usual.tracker, wanted.settings.get("tracker", {})),
        velocities=with_figures(usual.velocities, wanted.settings.get("velocities", {})),
    )


def _figures(title: str, ways: Sequence[Approach], flown: Sequence[ArenaFlown], printed: str) -> tuple[Figure, ...]:
    straight = np.array([way.gap_straight_on_m() <= 0.0 for way in ways])
    clear = np.array([one.nearest_gap_m > 0.0 for one in flown])
    errors = np.array([error for one in flown for error in one.errors]).reshape(-1, 3)
    return (
        Figure(f"{title}: avoided", float(clear.mean()), least=AVOIDED, paper=printed),
        Figure(f"{title}: came through", float(np.mean([one.arrived for one in flown])), least=THROUGH),
        Figure(f"{title}: would have been avoided straight on", float(1.0 - straight.mean())),
        Figure(f"{title}: median gap between the hulls", float(np.median([o.nearest_gap_m for o in flown])), unit=" m"),
        Figure(f"{title}: range error, root mean square", rms(errors[:, 1]), unit=" m", paper="0.15 m (the sensor's)"),
        Figure(
            f"{title}: bearing error, root mean square",
            math.degrees(rms(errors[:, 2])),
            unit=" deg",
            paper="2 deg inside 20, 8 deg to 65 (the sensor's)",
        ),
    )


def _errors_by_angle(errors: Sequence[tuple[float, float, float]]) -> tuple[str, ...]:
    """Fig. 8: mean errors of tracks in view against the true places, by the distance from the nose."""
    return tuple(
        f"{low:2d}-{low + 5} deg off the nose: {range_m:.2f} m, {bearing_deg:.1f} deg, {frames} frames"
        for low, range_m, bearing_deg, frames in errors_by_angle(errors)
    )


def _alerts(flown: Sequence[ArenaFlown]) -> tuple[AlertSeen, ...]:
    """When each way was first left for an obstacle, on the clock of all of them."""
    out, began_s = [], 0.0
    for one in flown:
        if one.first_evasion_s is not None:
            out.append(AlertSeen(began_s + one.first_evasion_s, "radar", None))
        began_s += one.duration_s
    return tuple(out)


def errors_by_angle(errors: Errors) -> list[tuple[int, float, float, int]]:
    """Degrees off the nose from which on, mean errors of range (m) and bearing (deg), frames."""
    rows = np.array(errors).reshape(-1, 3)
    off_deg = np.degrees(rows[:, 0])
    found = []
    for low in FAR_DEG:
        some = rows[(off_deg >= low) & (off_deg < low + 5)]
        if len(some) >= LEAST_SAMPLES:
            found.append((low, float(some[:, 1].mean()), float(np.degrees(some[:, 2].mean())), len(some)))
    return found


def error_charts(errors: Errors) -> tuple[Chart, ...]:
    """Fig. 8."""
    found = errors_by_angle(errors)
    return (
        _error_chart("Range error (fig. 8)", "mean error, m", [(low, range_m) for low, range_m, _, _ in found]),
        _error_chart("Bearing error (fig. 8)", "mean error, deg", [(low, deg) for low, _, deg, _ in found]),
    )


def _error_chart(title: str, label: str, rows: Sequence[tuple[int, float]]) -> Chart:
    """From zero on: a trend is one only against its own size."""
    highest = max((value for _, value in rows), default=1.0)
    tracks = series("tracks", [low + 2.5 for low, _ in rows], [value for _, value in rows])
    return Chart(
        title, "off the nose, deg", label, (tracks,), x_span=(0.0, FAR_DEG[-1] + 5.0), y_span=(0.0, 1.1 * highest)
    )


def ways_chart(title: str, ways: Sequence[Approach], flown: Sequence[ArenaFlown]) -> Chart:
    """Figs 5 and 6, in which the poles stand the same for all: here each way is seen from the pole that it passes
    nearest, its own direction up.
    """
    tracks = [
        _seen_from_pole(way, np.array(one.path_enu_m).reshape(-1, 2)) for way, one in zip(ways, flown, strict=True)
    ]
    round_rad = np.linspace(0.0, 2.0 * np.pi, 61)
    touching_m = POLE_RADIUS_M + VEHICLE_RADIUS_M
    reach_m = 0.8 * HALF_M
    return Chart(
        f"Ways past the nearest pole, {title} (figs 5, 6)",
        "right of the pole, m",
        "along the way, m",
        (
            *(series("" if number else "flown", *track.T) for number, track in enumerate(tracks)),
            series("hulls touch", touching_m * np.sin(round_rad), touching_m * np.cos(round_rad)),
        ),
        x_span=(-reach_m, reach_m),
        y_span=(-reach_m, reach_m),
        is_true=True,
    )


def _seen_from_pole(way: Approach, path_enu_m: F64) -> F64:
    """(N, 2) right of the pole and along the way."""
    along = (way.goal_enu_m - way.start_enu_m) / way.length_m
    right = np.array([along[1], -along[0]])
    away_m = np.hypot(*(way.poles_enu_m[:, None, :] - path_enu_m[None, :, :]).transpose(2, 0, 1))
    nearest = way.poles_enu_m[away_m.min(axis=1).argmin()] if len(path_enu_m) else way.poles_enu_m[0]
    return (path_enu_m - nearest) @ np.column_stack([right, along])
