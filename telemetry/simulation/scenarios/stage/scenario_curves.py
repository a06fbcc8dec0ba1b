"""What of a scenario is a curve, as numbers: the command line and the console draw the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64

MOST_POINTS = 800
"""Of a series that is kept: more are no more to the eye."""


@dataclass(frozen=True, slots=True)
class Series:
    name: str
    """Empty: of the one before it."""
    x: tuple[float, ...]
    y: tuple[float, ...]
    drawn: Literal["line", "points"] = "line"
    printed: bool = False
    """As the paper prints it."""


@dataclass(frozen=True, slots=True)
class Chart:
    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    x_span: tuple[float, float] | None = None
    y_span: tuple[float, float] | None = None
    """None: as far as the series go."""
    is_true: bool = False
    """A drawing of places: as many metres in both directions."""


def series(
    name: str,
    x: ArrayLike,
    y: ArrayLike,
    *,
    drawn: Literal["line", "points"] = "line",
    printed: bool = False,
    most: int = MOST_POINTS,
) -> Series:
    """With every n-th point where there are too many; what is no number is left out."""
    places = np.column_stack([np.asarray(x, np.float64).ravel(), np.asarray(y, np.float64).ravel()])
    kept = _thinned(places[np.isfinite(places).all(axis=1)], most)
    return Series(name, tuple(kept[:, 0].round(4).tolist()), tuple(kept[:, 1].round(4).tolist()), drawn, printed)


def not_empty(*lines: Series) -> tuple[Series, ...]:
    """Those that have anything to draw: a key to nothing only asks for a second look."""
    return tuple(one for one in lines if one.x)


def ends(chart: Chart) -> tuple[tuple[float, float], tuple[float, float]]:
    """From where to where it is drawn, along x and y."""
    return (
        chart.x_span or _span([x for one in chart.series for x in one.x]),
        chart.y_span or _span([y for one in chart.series for y in one.y]),
    )


def _thinned(places: F64, most: int) -> F64:
    """The last point stays: it is an end."""
    step = math.ceil(len(places) / most)
    if step <= 1:
        return places
    return np.concatenate([places[:-1:step], places[-1:]])


def _span(values: Sequence[float], margin: float = 0.04) -> tuple[float, float]:
    if not values:
        return 0.0, 1.0
    low, high = min(values), max(values)
    wide = (high - low) * margin or max(abs(high) * margin, 0.5)
    return low - wide, high + wide
