"""The arena as the paper draws it: the ways past the poles (figs 5, 6), and errors off the nose (fig. 8)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.simulation.scenarios.arena.arena_course import HALF_M, POLE_RADIUS_M, VEHICLE_RADIUS_M, Approach
from telemetry.simulation.scenarios.arena.arena_flight import ArenaFlown
from telemetry.simulation.scenarios.stage.curves import Chart, series

FAR_DEG = tuple(range(0, 40, 5))
"""Off the nose: the steps of the table of errors."""
LEAST_SAMPLES = 30
Errors = Sequence[tuple[float, float, float]]
"""Of tracked poles in view: off the nose (rad), error of range (m), error of bearing (rad)."""


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
