"""The curves of a scenario as figures: what the console draws, from the same numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from telemetry.simulation.scenarios.stage.result import ScenarioResult
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, Series, ends

_COLOURS = ("#1f6f8b", "#e4572e", "#2e6b34", "#7d3fd1", "#8a6d1d")
_PRINTED = "#333333"
MOST_COLUMNS = 3
MANY = 40
"""More points than these are drawn small."""


def write_charts(folder: Path, result: ScenarioResult) -> list[Path]:
    """One figure for each part of the scenario that has curves. Raises OSError."""
    drawn = [part for part in result.flights if part.charts]
    return [
        write_figure(folder / _file_name(part.title), part.charts, f"{result.name}, seed {result.seed}: {part.title}")
        for part in drawn
    ]


def write_figure(path: Path, charts: tuple[Chart, ...], title: str) -> Path:
    """Several charts side by side, in rows. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = min(len(charts), MOST_COLUMNS)
    rows = -(-len(charts) // columns)
    figure = Figure(figsize=(4.8 * columns, 4.8 * rows), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, chart in zip(places, charts, strict=False):
        _draw(axes, chart)
    for axes in places[len(charts) :]:
        axes.set_axis_off()
    figure.suptitle(title, fontsize=10, color="#555555")
    figure.savefig(path, metadata={"Software": None})
    return path


def _file_name(title: str) -> str:
    return f"{re.sub('[^a-z0-9]+', '-', title.lower()).strip('-')}.png"


def _draw(axes: Axes, chart: Chart) -> None:
    named, last = -1, ""
    for one in chart.series:
        # "ours" and "ours, in use" are of one colour, as is what has no name and the one before it.
        if one.name and not (last and one.name.startswith(f"{last},")):
            named, last = named + 1, one.name
        colour = _PRINTED if one.printed else _COLOURS[max(named, 0) % len(_COLOURS)]
        axes.plot(one.x, one.y, color=colour, linewidth=1.2, label=one.name or None, **_style(one))
    x_span, y_span = ends(chart)
    axes.set(xlim=x_span, ylim=y_span, xlabel=chart.x_label, ylabel=chart.y_label)
    axes.set_title(chart.title, fontsize=9)
    if chart.is_true:
        axes.set_aspect("equal", adjustable="box")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=2)


def _style(one: Series) -> dict[str, Any]:
    if one.printed and one.drawn == "line":
        return {"linestyle": "--", "zorder": 5}
    if one.printed:
        return {"linestyle": "", "marker": "x", "markersize": 9, "markeredgewidth": 2, "zorder": 5}
    if one.drawn == "points":
        return {"linestyle": "", "marker": "o", "markersize": 2 if len(one.x) > MANY else 5}
    return {}
