"""What the scenario lane's worker does: flies one of the papers' field tests, and what it came to as pages show it."""

from __future__ import annotations

import math

from server.schemas import ChartDoc, ScenarioFigureDoc, ScenarioPartDoc, SeriesDoc
from server.work.jobs import Progress
from telemetry.simulation.scenarios.catalogue import run_scenario
from telemetry.simulation.scenarios.stage.result import Figure, FlightResult, ScenarioRequest
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, ends


def fly(name: str, seed: int, *, report: Progress) -> tuple[list[ScenarioPartDoc], bool]:
    """Its parts, and whether every figure was reached."""
    report("Getting ready", None)
    result = run_scenario(name, ScenarioRequest(seed, charts=True, report=report))
    return [part_doc(part) for part in result.flights], result.passed


def part_doc(part: FlightResult) -> ScenarioPartDoc:
    return ScenarioPartDoc(
        title=part.title,
        duration_s=part.duration_s,
        contact=part.contact,
        min_true_distance_m=_finite(part.min_true_distance_m),
        alerts=len(part.alerts),
        figures=[_figure_doc(figure) for figure in part.figures],
        notes=list(part.notes),
        charts=[_chart_doc(chart) for chart in part.charts],
    )


def _figure_doc(figure: Figure) -> ScenarioFigureDoc:
    is_held = figure.least is not None or figure.most is not None
    return ScenarioFigureDoc(
        words=figure.words,
        value=_finite(figure.value),
        unit=figure.unit.strip(),
        least=figure.least,
        most=figure.most,
        verdict=figure.verdict if is_held else None,
        paper=figure.paper,
    )


def _chart_doc(chart: Chart) -> ChartDoc:
    x_span, y_span = ends(chart)
    return ChartDoc(
        title=chart.title,
        x_label=chart.x_label,
        y_label=chart.y_label,
        x_span=x_span,
        y_span=y_span,
        is_true=chart.is_true,
        series=[
            SeriesDoc(name=one.name, x=list(one.x), y=list(one.y), drawn=one.drawn, printed=one.printed)
            for one in chart.series
        ],
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
