"""The part of a large surface model that one plan needs, and whether it was enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planning.dsm import F64, Dsm
from planning.model import Certificate, FlownLine
from planning.request import PlanRequest

LARGE_PX = 4_000_000
"""Smaller models are taken whole."""
MARGIN_M = 10.0
"""Around the points, beside what the ball and the Gaussian reach."""
GROWTH = 3.0


def least_margin_m(request: PlanRequest) -> float:
    """Beyond the points' bounding box: what the safe surface feels, and where the certificate should find ground."""
    surface = request.surface
    sigma_m = surface.radius_m / 10 if surface.smooth_sigma_m is None else surface.smooth_sigma_m
    felt_m = 1.5 * surface.radius_m + 5.0 * sigma_m + surface.height_m  # with the blocks of the fast form
    return felt_m + request.clearance().required_clearance_m + MARGIN_M


def needed_part(dsm: Dsm, xy_m: F64, margin_m: float) -> Dsm:
    """The model within ``margin_m`` of the bounding box of projected (N, 2) points; whole where that saves little."""
    if dsm.elevation_m.size < LARGE_PX or not np.isfinite(xy_m).all():
        return dsm
    rows, columns = dsm.fractional_cell(np.array([xy_m.min(axis=0) - margin_m, xy_m.max(axis=0) + margin_m]))
    row0, column0 = max(0, int(rows.min())), max(0, int(columns.min()))
    row1, column1 = min(dsm.height_px, int(rows.max()) + 1), min(dsm.width_px, int(columns.max()) + 1)
    if row0 >= row1 or column0 >= column1 or (row1 - row0) * (column1 - column0) > dsm.elevation_m.size / 2:
        return dsm
    part = dsm.window(row0, column0, row1 - row0, column1 - column0)
    return replace(part, elevation_m=np.ascontiguousarray(part.elevation_m))


def was_enough(part: Dsm, whole: Dsm, line: FlownLine, certificate: Certificate) -> bool:
    """Whether the certificate over the part is the one over the whole model.

    All ground beyond the part counts as infinitely high. Nothing that was found is as far as that, so nothing
    that was found is there, and nothing beyond it could be nearer.
    """
    if part is whole:
        return True
    to_cut_m = _to_cut_m(part, whole, np.vstack([line.points_m[:, :2], [line.home_xy_m]]))
    found_m = max(
        float(certificate.trend_distance_m.max()),
        *(leg.min_distance_m for leg in certificate.legs),
        certificate.required_clearance_m,
    )
    return found_m < to_cut_m


def _to_cut_m(part: Dsm, whole: Dsm, xy_m: F64) -> float:
    """Smallest distance of any point between projected (N, 2) points to where the part was cut off."""
    (west, south, east, north), outer = part.bounds_m, whole.bounds_m
    half_m = 0.5 * part.resolution_m
    low, high = xy_m.min(axis=0), xy_m.max(axis=0)
    cuts = [
        (abs(west - outer[0]) > half_m, low[0] - west),
        (abs(south - outer[1]) > half_m, low[1] - south),
        (abs(east - outer[2]) > half_m, east - high[0]),
        (abs(north - outer[3]) > half_m, north - high[1]),
    ]
    return float(min((away_m for is_cut, away_m in cuts if is_cut), default=np.inf))
