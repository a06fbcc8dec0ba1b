"""Tracks against truth, as Wessendorp 2021 draws them (fig. 7): over ground, and from the radar."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from telemetry.simulation.scenarios.arena.against_truth import TruthComparison
from telemetry.simulation.scenarios.arena.arena_radar import Position2GoModel

NAME = "tracks.png"
_TRUE, _FOLLOWED = ("#e4a13a", "#6ab4d8", "#8cc084"), ("#c0392b", "#1f3f8b", "#2e6b34")
_GREY = "#999999"


def write_tracks(folder: Path, found: TruthComparison, title: str) -> Path:
    """One figure. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    figure = Figure(figsize=(11.0, 5.6), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    over_ground, from_radar = figure.subplots(1, 2)
    _over_ground(over_ground, found)
    _from_radar(from_radar, found)
    figure.suptitle(title, fontsize=10, color="#555555")
    path = folder / NAME
    figure.savefig(path, metadata={"Software": None})
    return path


def _over_ground(axes: Axes, found: TruthComparison) -> None:
    path = np.array(found.path_en_m)
    axes.plot(path[:, 0], path[:, 1], color="#444444", linewidth=1.2, label="vehicle")
    axes.plot(*path[0], "o", color="#444444", markersize=5, label="start")
    for number, pole in enumerate(found.poles):
        axes.plot(*pole.place_en_m, "o", color=_TRUE[number % 3], markersize=9, label=f"pole {number + 1}")
    axes.set(title="True way and poles", xlabel="x [m]", ylabel="-z [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="lower right")


def _from_radar(axes: Axes, found: TruthComparison) -> None:
    radar = Position2GoModel()
    for side in (-1, 1):
        right, forward = math.sin(side * radar.half_fov_rad), math.cos(radar.half_fov_rad)
        axes.plot([0.0, radar.farthest_m * right], [0.0, radar.farthest_m * forward], color=_GREY, linewidth=0.8)
    if found.others:
        others = np.array(found.others)
        axes.plot(others[:, 1], others[:, 2], ".", color=_GREY, markersize=3, label="followed where no pole is")
    for number, pole in enumerate(found.poles):
        true, followed = np.array(pole.in_view).reshape(-1, 3), np.array(pole.followed).reshape(-1, 3)
        axes.plot(true[:, 1], true[:, 2], "-", color=_TRUE[number % 3], linewidth=3, label=f"pole {number + 1}, true")
        axes.plot(
            followed[:, 1], followed[:, 2], ".", color=_FOLLOWED[number % 3], markersize=5,
            label=f"pole {number + 1}, followed",
        )  # fmt: skip
    axes.set(title="From the radar", xlabel="right [m]", ylabel="forward [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
