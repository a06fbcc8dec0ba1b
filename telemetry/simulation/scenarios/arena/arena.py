"""Scenario: past two poles in a hall by a Position2Go, flown by what avoids in flight (Wessendorp 2021, figs 5-8)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planning.errors import ParameterError
from telemetry.simulation.scenarios.arena.arena_charts import error_charts, errors_by_angle, ways_chart
from telemetry.simulation.scenarios.arena.arena_course import Approach, approaches
from telemetry.simulation.scenarios.arena.arena_flight import ArenaFlown, arena_settings, fly
from telemetry.simulation.scenarios.stage.result import (
    AlertSeen,
    Figure,
    FlightResult,
    MapFigures,
    ScenarioRequest,
    ScenarioResult,
)
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import with_figures

NAME = "arena"
AVOIDED, THROUGH = 1.0, 0.98


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
        radar=MapFigures(),
        vision=MapFigures(),
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
        Figure(f"{title}: range error, root mean square", _rms(errors[:, 1]), unit=" m", paper="0.15 m (the sensor's)"),
        Figure(
            f"{title}: bearing error, root mean square",
            math.degrees(_rms(errors[:, 2])),
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


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan
