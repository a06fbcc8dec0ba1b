"""A line chart as SVG text."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from mapping.geometry.arrays import F64, I64

LEFT, RIGHT, TOP, BOTTOM = 58, 16, 34, 46
INK, MUTED, GRID = "#1f2933", "#5b6770", "#e3e8ec"


@dataclass(frozen=True, slots=True)
class Series:
    """One line: x and y of equal length; NaN breaks it."""

    x: F64
    y: F64
    name: str
    color: str
    width: float = 1.8
    dash: str = ""
    fill: str = ""
    """Colour of the area down to the axis; empty: none."""
    dots: bool = False


@dataclass(frozen=True, slots=True)
class Mark:
    """A labelled place on a chart: a point, or a vertical line when y is None."""

    x: float
    y: float | None
    text: str
    color: str = MUTED
    text_at_foot: bool = False


@dataclass(frozen=True, slots=True)
class Chart:
    """What is drawn; ranges come from the series."""

    x_label: str
    y_label: str
    series: Sequence[Series]
    marks: Sequence[Mark] = field(default_factory=tuple)
    width: int = 980
    height: int = 300
    y_from_zero: bool = False


@dataclass(frozen=True, slots=True)
class _Axes:
    x_low: float
    x_high: float
    y_low: float
    y_high: float
    chart: Chart

    def px(self, x: F64 | float) -> F64 | float:
        return LEFT + (x - self.x_low) / (self.x_high - self.x_low) * (self.chart.width - LEFT - RIGHT)

    def py(self, y: F64 | float) -> F64 | float:
        inner = self.chart.height - TOP - BOTTOM
        return TOP + (1 - (y - self.y_low) / (self.y_high - self.y_low)) * inner


def render_chart(chart: Chart) -> str:
    """The chart as one ``<svg>`` element; all text in it is escaped."""
    axes = _axes(chart)
    parts = [
        f'<svg class="chart" viewBox="0 0 {chart.width} {chart.height}" role="img" '
        f'aria-label="{escape(chart.y_label)} against {escape(chart.x_label)}">',
        *_grid(axes),
        *(_area(s, axes) for s in chart.series if s.fill),
        *(_vertical(m, axes) for m in chart.marks if m.y is None),
        *(_line(s, axes) for s in chart.series),
        *(_point(m, axes) for m in chart.marks if m.y is not None),
        *_frame(axes),
        *_legend(chart),
        "</svg>",
    ]
    return "\n".join(part for part in parts if part)


def _axes(chart: Chart) -> _Axes:
    x = np.concatenate([s.x for s in chart.series])
    y = np.concatenate([s.y for s in chart.series])
    x, y = x[np.isfinite(x)], y[np.isfinite(y)]
    x_low, x_high = (float(x.min()), float(x.max())) if len(x) else (0.0, 1.0)
    y_low, y_high = (float(y.min()), float(y.max())) if len(y) else (0.0, 1.0)
    headroom = 0.04 * (y_high - y_low)
    y_low, y_high = padded(min(0.0, y_low) if chart.y_from_zero else y_low, y_high + headroom, _y_count(chart))
    return _Axes(x_low, x_high if x_high > x_low else x_low + 1.0, y_low, y_high, chart)


def _y_count(chart: Chart) -> int:
    return max(3, chart.height // 50)


def _x_count(chart: Chart) -> int:
    return max(3, chart.width // 90)


def _grid(axes: _Axes) -> list[str]:
    chart = axes.chart
    lines = [
        f'<rect x="{LEFT}" y="{TOP}" width="{chart.width - LEFT - RIGHT}" height="{chart.height - TOP - BOTTOM}" '
        'fill="#fbfcfd"/>'
    ]
    for y in ticks(axes.y_low, axes.y_high, _y_count(chart)):
        py, text = axes.py(y), label(y, round_step(axes.y_high - axes.y_low, _y_count(chart)))
        lines.append(f'<path d="M{LEFT} {py:.1f}H{chart.width - RIGHT}" stroke="{GRID}"/>')
        lines.append(f'<text x="{LEFT - 8}" y="{py + 4:.1f}" text-anchor="end" fill="{MUTED}">{text}</text>')
    for x in ticks(axes.x_low, axes.x_high, _x_count(chart)):
        px, text = axes.px(x), label(x, round_step(axes.x_high - axes.x_low, _x_count(chart)))
        foot = chart.height - BOTTOM
        lines.append(f'<path d="M{px:.1f} {TOP}V{foot + 4}" stroke="{GRID}"/>')
        lines.append(f'<text x="{px:.1f}" y="{foot + 18}" text-anchor="middle" fill="{MUTED}">{text}</text>')
    return lines


def _frame(axes: _Axes) -> list[str]:
    chart, foot = axes.chart, axes.chart.height - BOTTOM
    middle = (TOP + foot) / 2
    return [
        f'<path d="M{LEFT} {TOP}V{foot}H{chart.width - RIGHT}" fill="none" stroke="{MUTED}"/>',
        f'<text x="{(LEFT + chart.width - RIGHT) / 2}" y="{chart.height - 8}" text-anchor="middle" fill="{INK}">'
        f"{escape(chart.x_label)}</text>",
        f'<text transform="translate(14 {middle}) rotate(-90)" text-anchor="middle" fill="{INK}">'
        f"{escape(chart.y_label)}</text>",
    ]


def _runs(series: Series, axes: _Axes) -> list[F64]:
    """Pixel polylines (N, 2) between gaps, thinned."""
    kept = keep_extremes(series.y)
    x, y = series.x[kept], series.y[kept]
    pixels = np.column_stack([np.asarray(axes.px(x)), np.asarray(axes.py(y))])
    known = np.isfinite(pixels).all(axis=1)
    cuts = np.flatnonzero(np.diff(known.astype(np.int8))) + 1
    return [run for run in np.split(pixels, cuts) if len(run) and np.isfinite(run).all()]


def _points(run: F64) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in run)


def _area(series: Series, axes: _Axes) -> str:
    foot = axes.chart.height - BOTTOM
    shapes = (
        f'<polygon points="{run[0, 0]:.1f},{foot} {_points(run)} {run[-1, 0]:.1f},{foot}" fill="{series.fill}"/>'
        for run in _runs(series, axes)
    )
    return "".join(shapes)


def _line(series: Series, axes: _Axes) -> str:
    runs = _runs(series, axes)
    dash = f' stroke-dasharray="{series.dash}"' if series.dash else ""
    lines = "".join(
        f'<polyline points="{_points(run)}" fill="none" stroke="{series.color}" stroke-width="{series.width}"'
        f' stroke-linejoin="round" stroke-linecap="round"{dash}/>'
        for run in runs
    )
    if not series.dots:
        return lines
    return lines + "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.6" fill="#fff" stroke="{series.color}" stroke-width="1.4"/>'
        for run in runs
        for x, y in run
    )


def _vertical(mark: Mark, axes: _Axes) -> str:
    px, foot = axes.px(mark.x), axes.chart.height - BOTTOM
    anchor, shift = _side(float(px), axes, 4)
    return (
        f'<path d="M{px:.1f} {TOP}V{foot}" stroke="{mark.color}" stroke-dasharray="3 4" opacity="0.7"/>'
        f'<text x="{px + shift:.1f}" y="{TOP + 12}" text-anchor="{anchor}" fill="{mark.color}">'
        f"{escape(mark.text)}</text>"
    )


def _point(mark: Mark, axes: _Axes) -> str:
    """A ring, and its text at the edge of the plot where no curve hides it."""
    px, py = axes.px(mark.x), axes.py(mark.y or 0.0)
    anchor, shift = _side(float(px), axes, 5)
    foot = axes.chart.height - BOTTOM
    text_y, edge = (foot - 8, foot) if mark.text_at_foot else (TOP + 14, TOP)
    return (
        f'<path d="M{px:.1f} {py:.1f}V{edge}" stroke="{mark.color}" stroke-width="1.2"/>'
        f'<circle cx="{px:.1f}" cy="{py:.1f}" r="5.5" fill="none" stroke="#fff" stroke-width="4.5"/>'
        f'<circle cx="{px:.1f}" cy="{py:.1f}" r="5.5" fill="none" stroke="{mark.color}" stroke-width="2.2"/>'
        f'<text x="{px + shift:.1f}" y="{text_y}" text-anchor="{anchor}" fill="{mark.color}" class="halo">'
        f"{escape(mark.text)}</text>"
    )


def _side(px: float, axes: _Axes, gap: int) -> tuple[str, int]:
    """Text goes to the right of its place, to the left near the right edge."""
    return ("end", -gap) if px > axes.chart.width - RIGHT - 130 else ("start", gap)


def _legend(chart: Chart) -> list[str]:
    entries, x = [], LEFT
    for series in (s for s in chart.series if s.name):
        swatch = f'<path d="M{x} 16h22" stroke="{series.color}" stroke-width="3"'
        dash = f' stroke-dasharray="{series.dash}"' if series.dash else ""
        entries.append(f"{swatch}{dash}/>")
        entries.append(f'<text x="{x + 28}" y="20" fill="{INK}">{escape(series.name)}</text>')
        x += 28 + 20 + round(6.6 * len(series.name))
    return entries


def keep_extremes(y: F64, max_points: int = 1200) -> I64:
    """Indices of at most about ``max_points`` samples: the ends, and each bucket's lowest and highest.

    NaN samples count as neither; a bucket of nothing but NaN keeps its first, so that gaps stay gaps.
    """
    if len(y) <= max_points:
        return np.arange(len(y))
    edges = np.linspace(0, len(y), max(2, max_points // 2) + 1).astype(np.int64)
    low, high = np.where(np.isnan(y), np.inf, y), np.where(np.isnan(y), -np.inf, y)
    picked = [a + k for a, b in itertools.pairwise(edges) for k in (np.argmin(low[a:b]), np.argmax(high[a:b]))]
    return np.unique(np.array([0, len(y) - 1, *picked], dtype=np.int64))


def round_step(span: float, count: int) -> float:
    """The smallest 1-2-5 step that divides ``span`` into at most ``count`` parts."""
    raw = max(span, 1e-12) / max(count, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw * (1 - 1e-9))


def ticks(low: float, high: float, count: int = 6) -> list[float]:
    """Round values inside [low, high], about ``count`` of them."""
    step = round_step(high - low, count)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def label(value: float, step: float) -> str:
    """A tick's text with as many decimals as its step needs."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value + 0.0:.{decimals}f}"


def padded(low: float, high: float, count: int = 6) -> tuple[float, float]:
    """The range widened to whole ticks."""
    step = round_step(max(high - low, 1e-9), count)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return first * step, max(last, first + 1) * step
