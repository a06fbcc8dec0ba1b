"""Curves of a plan, thinned so that no peak and no gorge is lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import F64, I64
from mapping.geometry.polyline import along_m
from planning.planner.plan import Plan
from server.schemas import Chart

_MAX_POINTS = 1600


def chart(plan: Plan) -> Chart:
    """Heights above home over distance, as the altitude profile draws them."""
    path, home_m = plan.path, plan.line.home_alt_dsm_m
    keep = thinned(path.s_m, path.ground_alt_dsm_m, path.alt_dsm_m, must_keep=path.vertex)
    flown = plan.line.points_m
    pois = [(int(sample), poi) for sample, poi in zip(path.vertex, path.vertex_poi, strict=True) if poi is not None]
    trend_keep = thinned(plan.certificate.trend_s_m, plan.certificate.trend_distance_m)
    return Chart(
        s_m=_rounded(path.s_m[keep]),
        ground_rel_home_m=_nullable(path.ground_alt_dsm_m[keep] - home_m),
        surface_rel_home_m=_nullable(path.surface_alt_dsm_m[keep] - home_m),
        path_rel_home_m=_nullable(path.alt_dsm_m[keep] - home_m),
        flown_s_m=_rounded(along_m(flown[:, :2])),
        flown_rel_home_m=_rounded(flown[:, 2] - home_m),
        trend_s_m=_rounded(plan.certificate.trend_s_m[trend_keep]),
        trend_distance_m=_nullable(plan.certificate.trend_distance_m[trend_keep]),
        poi_s_m=_rounded(path.s_m[[sample for sample, _ in pois]]),
        poi_names=[plan.request.pois[poi].name or f"P{poi + 1}" for _, poi in pois],
    )


def thinned(s_m: F64, *curves: F64, must_keep: I64 | None = None) -> NDArray[np.intp]:
    """Indices that keep each curve's minimum and maximum in every bin, both ends and ``must_keep``."""
    count = len(s_m)
    if count <= _MAX_POINTS:
        return np.arange(count)
    bins = np.array_split(np.arange(count), _MAX_POINTS // (2 * max(1, len(curves))))
    kept = {0, count - 1} | (set() if must_keep is None else {int(i) for i in must_keep})
    for members in bins:
        for curve in curves:
            part = curve[members]
            if np.isfinite(part).any():
                kept |= {int(members[np.nanargmin(part)]), int(members[np.nanargmax(part)])}
    return np.array(sorted(kept))


def _rounded(values: F64) -> list[float]:
    return [round(float(v), 3) for v in values]


def _nullable(values: F64) -> list[float | None]:
    return [round(float(v), 3) if np.isfinite(v) else None for v in values]
