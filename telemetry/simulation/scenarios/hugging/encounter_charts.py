"""A flight among unknown objects as curves: its profile, what it was told of each object and when, false alarms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import Polyline, along_m
from telemetry.simulation.scenarios.hugging.encounters import HIGH, MOST_FALSE_PER_KM, Encounters, Passed, objects_of
from telemetry.simulation.scenarios.hugging.hugging import Hugging
from telemetry.simulation.scenarios.stage.result import Figure
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, Series, not_empty, series
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight
from telemetry.simulation.simulator.scene import World

WAY = "flown, level, m"
PRINTED_CROSS_M = 0.84
"""Largest cross-track error on Etna (Melita 2020, fig. 28)."""
BACK_M, ON_M = 5.0, 15.0
"""Of the line, around the place where the vehicle was before: where the line crosses itself it stays on its leg."""


def encounter_charts(flown: SeenFlight, world: World, found: Encounters) -> tuple[Chart, ...]:
    path, way_m = _way(flown)
    if not len(path):
        return ()
    false_m = way_m[[_at(flown, told.alert.done_t_mono_s) for told in found.false]]
    return (
        _profile(path, way_m, world, found, false_m),
        _distances(way_m, found.passed),
        _false_alarms(float(way_m[-1]), false_m),
    )


def _way(flown: SeenFlight) -> tuple[F64, F64]:
    """(N, 3) places and (N,) level metres so far; nothing of who has come nowhere."""
    path = np.array([truth.position_enu_m for truth in flown.track]).reshape(-1, 3)
    way_m = along_m(path[:, :2]) if len(path) else np.empty(0)
    return (path, way_m) if len(path) and way_m[-1] > 0.0 else (np.empty((0, 3)), np.empty(0))


def _at(flown: SeenFlight, t_mono_s: float) -> int:
    times = [truth.t_mono_s for truth in flown.track]
    return min(int(np.searchsorted(times, t_mono_s)), len(times) - 1)


def _profile(path: F64, way_m: F64, world: World, found: Encounters, false_m: F64) -> Chart:
    told = [one for one in found.passed if one.seen_by]
    at = [one.at for one in told]
    return Chart(
        "Height along the way (as figs 12 and 27)",
        WAY,
        "above home, m",
        not_empty(
            series("flown", way_m, path[:, 2]),
            series("surface model", way_m, world.terrain.ups_m(np.ascontiguousarray(path[:, :2]))),
            *_standing(path, way_m, world, found.passed),
            series("told of the next object", way_m[at], path[at, 2], drawn="points"),
            series("false alarm", false_m, np.interp(false_m, way_m, path[:, 2]), drawn="points"),
        ),
    )


def _standing(path: F64, way_m: F64, world: World, passed: Sequence[Passed]) -> list[Series]:
    """Upright, where the vehicle came to each."""
    rows = objects_of(world)
    lines = []
    for number, one in enumerate(passed):
        east, north, _ = (float(value) for value in path[one.met])
        ends = [world.ground_up_m(east, north), float(rows[one.name][:, HIGH].max())]
        lines.append(series("" if number else "what the model does not know", [way_m[one.met]] * 2, ends))
    return lines


def _distances(way_m: F64, passed: Sequence[Passed]) -> Chart:
    """Straight to the object's surface when the vehicle could first have begun to brake, and what braking needs."""
    in_order = sorted(passed, key=lambda one: one.met)
    late = [one for one in in_order if not one.in_time]
    lines = not_empty(
        series("told at", *_rows(way_m, [(one.met, one.distance_m) for one in in_order]).T, drawn="points"),
        series("needed to stop", *_rows(way_m, [(one.met, one.needed_m) for one in in_order]).T, drawn="points"),
        series("too late or never", *_rows(way_m, [(one.met, one.distance_m) for one in late]).T, drawn="points"),
    )
    highest = max((value for one in lines for value in one.y), default=1.0)
    x_span = (0.0, float(way_m[-1]))
    return Chart(
        "Distance when told, by object", WAY, "to its surface, m", lines, x_span=x_span, y_span=(0.0, 1.1 * highest)
    )


def _rows(way_m: F64, found: Sequence[tuple[int, float]]) -> F64:
    return np.array([(way_m[at], value) for at, value in found], np.float64).reshape(-1, 2)


def _false_alarms(length_m: float, false_m: F64) -> Chart:
    """How many so far, beside what the flight is held to."""
    places = np.sort(false_m)
    steps_m = np.concatenate([[0.0], np.repeat(places, 2), [length_m]])
    count = np.repeat(np.arange(len(places) + 1), 2)
    lines = (
        series("false alarms so far", steps_m, count),
        series(f"at most {MOST_FALSE_PER_KM:g} per km", [0.0, length_m], [0.0, MOST_FALSE_PER_KM * length_m / 1000]),
    )
    highest = max(1.0, float(len(places)), MOST_FALSE_PER_KM * length_m / 1000)
    y_span = (0.0, 1.1 * highest)
    return Chart("False alarms along the way", WAY, "number", lines, x_span=(0.0, length_m), y_span=y_span)


def following(flown: SeenFlight, plan: Hugging) -> tuple[tuple[Figure, ...], tuple[Chart, ...]]:
    """How well the line is flown, and how far it keeps from the surface model: what the paper prints figures of."""
    nearest = Figure(
        "smallest distance from the line to the surface model",
        plan.clearance_m,
        unit=" m",
        paper="3.80 m (R = 20 m, on Etna)",
    )
    path, way_m = _way(flown)
    if not len(path):
        return (nearest,), ()
    off_m = cross_track_m(path, plan.line_enu_m)
    off = Figure("cross-track error, largest", float(off_m.max()), unit=" m", paper=f"{PRINTED_CROSS_M:g} m (on Etna)")
    lines = (
        series("off the line", way_m, off_m),
        series("largest, as printed", [0.0, way_m[-1]], [PRINTED_CROSS_M] * 2, printed=True),
    )
    y_span = (0.0, 1.1 * max(PRINTED_CROSS_M, float(off_m.max())))
    chart = Chart("Cross-track error (fig. 28)", WAY, "m", lines, x_span=(0.0, float(way_m[-1])), y_span=y_span)
    return (nearest, off), (chart,)


def cross_track_m(path_enu: F64, line_enu_m: F64) -> F64:
    """(N,) level distance from the line, followed from its beginning on."""
    line, s_m, off = Polyline(line_enu_m[:, :2]), 0.0, []
    for place in np.ascontiguousarray(path_enu[:, :2]):
        s_m, away_m = line.nearest(place, s_m - BACK_M, s_m + ON_M)
        off.append(away_m)
    return np.array(off)
