"""Tracks against truth in figures and curves, as Wessendorp 2021 shows them (figs 7 and 8), beside what it prints."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.simulation.scenarios.arena.against_truth import Pole, Seen, TruthComparison, rms
from telemetry.simulation.scenarios.arena.arena_radar import Position2GoModel
from telemetry.simulation.scenarios.stage.result import Figure, FlightResult, measured
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, Series, series

STEP_DEG, STEP_M = 5.0, 1.0
"""Over so much a mean of errors is taken."""
LEAST_SAMPLES = 5
RADAR = Position2GoModel()
PRINTED_RANGE, PRINTED_FRAME = "0.15 m (the sensor's)", "0.78 ms (Intel Up Core)"


def truth_part(found: TruthComparison, title: str) -> FlightResult:
    """What the command line tells and draws, and the console shows."""
    figures = [figure for number, pole in enumerate(found.poles, start=1) for figure in pole_figures(number, pole)]
    others = Figure("objects where no pole is, per frame", len(found.others) / found.frames)
    took_ms = 1e3 * float(np.median(found.frame_s)) if found.frame_s else math.nan
    took = Figure("processing and following of a frame, median", took_ms, unit=" ms", paper=PRINTED_FRAME)
    return measured(title, (*figures, others, took), _notes(found), truth_charts(found))


def pole_figures(number: int, pole: Pole) -> tuple[Figure, ...]:
    """Both readings of the bearing: the sensor is good ahead and poor aside."""
    edge_rad = RADAR.errors.params().bearing_edge_rad
    edge_deg = math.degrees(edge_rad)
    ahead = [error.bearing_rad for error in pole.errors if error.off_rad <= edge_rad]
    aside = [error.bearing_rad for error in pole.errors if error.off_rad > edge_rad]
    share = len(pole.followed) / len(pole.in_view) if pole.in_view else math.nan
    name = f"pole {number}"
    return (
        Figure(f"{name}: frames with it in view", float(len(pole.in_view))),
        Figure(f"{name}: share of those in which it was followed", share),
        Figure(f"{name}: range error (RMS)", rms([e.range_m for e in pole.errors]), unit=" m", paper=PRINTED_RANGE),
        _bearing_figure(f"{name}: bearing error within {edge_deg:g} deg (RMS)", ahead, "2 deg (the sensor's)"),
        _bearing_figure(f"{name}: bearing error beyond (RMS)", aside, "8 deg to 65 (the sensor's)"),
    )


def _bearing_figure(words: str, errors_rad: Sequence[float], paper: str) -> Figure:
    return Figure(words, math.degrees(rms(errors_rad)), unit=" deg", paper=paper)


def _notes(found: TruthComparison) -> list[str]:
    notes = [f"{found.left_out:,} of {found.frames + found.left_out:,} frames lie outside of the capture's time."]
    for number, pole in enumerate(found.poles, start=1):
        if not pole.in_view:
            notes.append(f"Pole {number} was never in view: 76 degrees, 1 to 12 m.")
    return notes if found.left_out else notes[1:]


def truth_charts(found: TruthComparison) -> tuple[Chart, ...]:
    errors = [error for pole in found.poles for error in pole.errors]
    off_deg = np.degrees([error.off_rad for error in errors])
    away_m = np.array([error.away_m for error in errors])
    range_m = np.abs([error.range_m for error in errors])
    bearing_deg = np.degrees(np.abs([error.bearing_rad for error in errors]))
    ends_deg, ends_m = (0.0, math.degrees(RADAR.half_fov_rad) + 2.0), (0.0, RADAR.farthest_m)
    sigma = RADAR.errors
    flat = series("printed for the sensor", ends_deg, [sigma.range_sigma_m] * 2, printed=True)
    edge_deg = sigma.bearing_edge_deg
    stair = series(
        "printed for the sensor",
        [0.0, edge_deg, edge_deg, ends_deg[1]],
        [sigma.bearing_sigma_deg] * 2 + [sigma.bearing_edge_sigma_deg] * 2,
        printed=True,
    )
    level = series("printed for the sensor", ends_m, [sigma.range_sigma_m] * 2, printed=True)
    off, away = "off the boresight, deg", "from the radar, m"
    return (
        over_ground(found),
        from_radar(found),
        _errors("Range error by bearing (fig. 8)", (off, "error, m"), (off_deg, range_m), STEP_DEG, ends_deg, flat),
        _errors("Bearing error (fig. 8)", (off, "error, deg"), (off_deg, bearing_deg), STEP_DEG, ends_deg, stair),
        _errors("Range error by distance", (away, "error, m"), (away_m, range_m), STEP_M, ends_m, level),
        _errors("Bearing error by distance", (away, "error, deg"), (away_m, bearing_deg), STEP_M, ends_m, None),
    )


def over_ground(found: TruthComparison) -> Chart:
    """Fig. 7, left: the capture's x to the right, its -z up."""
    path = np.array(found.path_en_m).reshape(-1, 2)
    poles = [
        series(f"pole {number}", *np.array([pole.place_en_m]).T, drawn="points")
        for number, pole in enumerate(found.poles, start=1)
    ]
    start = series("vehicle, start", *path[:1].T, drawn="points")
    every = np.concatenate([path, [pole.place_en_m for pole in found.poles]])
    middle, half_m = (every.min(axis=0) + every.max(axis=0)) / 2, 0.55 * float(np.ptp(every, axis=0).max()) + 0.5
    x, y = (float(value) for value in middle)
    return Chart(
        "True way and poles (fig. 7, left)",
        "x, m",
        "-z, m",
        (series("vehicle", *path.T), start, *poles),
        x_span=(x - half_m, x + half_m),
        y_span=(y - half_m, y + half_m),
        is_true=True,
    )


def from_radar(found: TruthComparison) -> Chart:
    """Fig. 7, right: the ways of the poles before the nose, where they truly were and where they were followed."""
    half, far_m = RADAR.half_fov_rad, RADAR.farthest_m
    right, ahead = far_m * math.sin(half), far_m * math.cos(half)
    beam = series("half-power beam, 76 deg", [-right, 0.0, right], [ahead, 0.0, ahead], printed=True)
    others = series("where no pole is", *_places(found.others).T, drawn="points")
    lines: list[Series] = []
    for number, pole in enumerate(found.poles, start=1):
        lines.append(series(f"pole {number}, followed", *_places(pole.followed).T, drawn="points"))
        lines.append(series(f"pole {number}, true", *_places(pole.in_view).T))
    return Chart(
        "From the radar (fig. 7, right)",
        "right, m",
        "forward, m",
        (*lines, *([others] if found.others else []), beam),
        x_span=(-right - 0.5, right + 0.5),
        y_span=(-0.5, far_m + 0.5),
        is_true=True,
    )


def _places(seen: Sequence[Seen]) -> F64:
    """(N, 2) Right and forward."""
    return np.array([(one.right_m, one.forward_m) for one in seen], np.float64).reshape(-1, 2)


def _errors(
    title: str,
    labels: tuple[str, str],
    points: tuple[F64, F64],
    step: float,
    ends: tuple[float, float],
    printed: Series | None,
) -> Chart:
    """Each frame's error and the means over steps, from zero on: a trend is one only against its own size."""
    x, y = points
    rows = [(low, y[(x >= low) & (x < low + step)]) for low in np.arange(0.0, ends[1], step)]
    means = [(low + step / 2, float(some.mean())) for low, some in rows if len(some) >= LEAST_SAMPLES]
    lines = [
        series("each frame", x, y, drawn="points"),
        series(f"mean over {step:g} {labels[0].rpartition(' ')[2]}", *np.array(means).reshape(-1, 2).T),
        *([printed] if printed is not None else []),
    ]
    highest = max((value for one in lines for value in one.y), default=1.0)
    return Chart(title, *labels, tuple(lines), x_span=ends, y_span=(0.0, 1.1 * highest or 1.0))
