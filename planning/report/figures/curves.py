"""The report's charts: altitude profile, clearance trend, speed and time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import along_m
from planning.basics.plan_model import FlownLine, Poi, SampledPath, Timing
from planning.certificate.certificate_model import Certificate
from planning.formats.safe_text import clean_name
from planning.margins.words import rounded_up
from planning.report.figures.chart import Chart, Mark, Series, render_chart
from planning.report.words import metres

TERRAIN, SURFACE, PATH, FLOWN = "#7a6a55", "#d9822b", "#1769aa", "#243b53"
GOOD, TIGHT, BAD = "#2e8540", "#d9822b", "#c62828"
DISTANCE = "Distance flown (m)"
_LONGEST_MARK = 14


def altitude_profile(path: SampledPath, line: FlownLine, certificate: Certificate, pois: Sequence[Poi]) -> str:
    """Terrain, dilated surface, sampled path and flown waypoints over home, against distance (Melita 2020, fig. 12)."""
    home = line.home_alt_dsm_m
    flown_s_m = line_distance(line)
    series = (
        Series(path.s_m, path.ground_alt_dsm_m - home, "terrain (DSM)", TERRAIN, 1.2, fill="#e6ddd0"),
        Series(path.s_m, path.surface_alt_dsm_m - home, "dilated, smoothed surface", SURFACE, 1.5, dash="5 3"),
        Series(path.s_m, path.alt_dsm_m - home, "sampled path", PATH, 1.5),  # Melita 2020, fig. 12
        Series(flown_s_m, line.points_m[:, 2] - home, "waypoints as flown", FLOWN, 1.6, dots=len(flown_s_m) <= 400),
    )
    worst = certificate.worst
    marks = [
        *_poi_marks(path, pois),
        *_worst_mark(certificate, worst.s_m, worst.alt_rel_home_m, at_foot=True),
    ]
    return render_chart(Chart(DISTANCE, "Height above home (m)", series, marks, height=360))


def clearance_trend(certificate: Certificate) -> str:
    """Smallest 3-D distance to the surface model along the flown line, with the required distance."""
    s_m, d_m, need = certificate.trend_s_m, _finite(certificate.trend_distance_m), certificate.required_clearance_m
    short = np.where(d_m < need, d_m, np.nan)
    series = [
        Series(s_m, d_m, "distance to the surface model", GOOD, 1.8, fill="#e8f3ea"),
        Series(_ends(s_m), np.array([need, need]), f"required {rounded_up(need)} m", BAD, 1.4, dash="6 4"),
    ]
    if np.isfinite(short).any():
        series.append(Series(s_m, short, "below required", TIGHT, 2.6))
    if (d_m <= 0).any():
        series.append(Series(s_m, np.where(d_m <= 0, d_m, np.nan), "inside terrain", BAD, 3.2))
    mark = _worst_mark(certificate, certificate.worst.s_m, certificate.min_distance_m)
    return render_chart(Chart(DISTANCE, "3-D distance (m)", series, mark, height=270, y_from_zero=True))


def speed_chart(path: SampledPath, timing: Timing, *, width: int = 482) -> str:
    """Ground speed of the timing law against distance."""
    series = (Series(path.s_m, timing.speed_m_s, "ground speed", PATH, fill="#e6f0f8"),)
    return render_chart(Chart(DISTANCE, "Speed (m/s)", series, width=width, height=240, y_from_zero=True))


def time_chart(path: SampledPath, timing: Timing, *, width: int = 482) -> str:
    """Time since the first sample against distance; steps are loiter."""
    series = (Series(path.s_m, timing.t_s, "time, loiter included", FLOWN, fill="#e9edf1"),)
    return render_chart(Chart(DISTANCE, "Time (s)", series, width=width, height=240, y_from_zero=True))


def line_distance(line: FlownLine) -> F64:
    """(K,) horizontal distance flown at each point of the line."""
    return along_m(line.points_m[:, :2])


def _poi_marks(path: SampledPath, pois: Sequence[Poi]) -> list[Mark]:
    places = [(v, k) for v, k in zip(path.vertex, path.vertex_poi, strict=True) if k is not None]
    if len(places) > 30:
        return []
    return [Mark(float(path.s_m[v]), None, short_name(pois[k], k)) for v, k in places]


def short_name(poi: Poi, index: int) -> str:
    """The POI's name, or its number, short enough for a figure."""
    name = clean_name(poi.name) or str(index + 1)
    return name if len(name) <= _LONGEST_MARK else f"{name[: _LONGEST_MARK - 1]}…"


def _worst_mark(certificate: Certificate, s_m: float, y: float, *, at_foot: bool = False) -> list[Mark]:
    if not (np.isfinite(s_m) and np.isfinite(y)):
        return []
    text = f"worst point, {metres(certificate.min_distance_m)}"
    return [Mark(s_m, y, text, BAD, at_foot)]


def _finite(values: F64) -> F64:
    return np.where(np.isfinite(values), values, np.nan)


def _ends(values: F64) -> F64:
    return np.array([values[0], values[-1]]) if len(values) else np.array([0.0, 1.0])
