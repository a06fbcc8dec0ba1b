"""Legs laid around a fence: 200 zones and 50 points."""

from __future__ import annotations

import math
import time

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.fence.fence_model import Fence, FenceCircle, FencePolygon, circle, polygon
from planning.route.around_fence import Kept, laid_legs
from planning.terrain.dsm import Dsm

ZONES, POINTS, SIDE_M, MARGIN_M = 200, 50, 2000.0, 3.0
LIMIT_S = 1.0


def main() -> None:
    rng = np.random.default_rng(1)
    transform = Affine(SIDE_M / 8, 0, 499_000.0, 0, -SIDE_M / 8, 4_171_000.0)
    dsm = Dsm(np.zeros((8, 8), np.float32), transform, CRS.from_epsg(32633), None, "")
    points_xy_m = np.array(dsm.bounds_m[:2]) + rng.uniform(0.05 * SIDE_M, 0.95 * SIDE_M, (POINTS, 2))
    fence = _fence(dsm, rng, points_xy_m)
    lat_deg, lon_deg = dsm.lat_lon_from_xy(points_xy_m[:1])[0]
    kept = Kept(fence, (float(lat_deg), float(lon_deg)), (), MARGIN_M, 5.0)
    corners = sum(len(leg.shapes) for leg in laid_legs(dsm, points_xy_m, kept).legs)
    times = []
    for _ in range(3):
        start_s = time.perf_counter()
        laid_legs(dsm, points_xy_m, kept)
        times.append(time.perf_counter() - start_s)
    print(
        f"{POINTS} points between {ZONES} zones, {corners} corners: best {min(times):.3f} s "
        f"(at most {LIMIT_S:g} s: {'yes' if min(times) <= LIMIT_S else 'NO'})"
    )


def _fence(dsm: Dsm, rng: np.random.Generator, points_xy_m: np.ndarray) -> Fence:
    """Circles and star-shaped polygons that hold none of the points."""
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    while len(polygons) + len(circles) < ZONES:
        radius_m, centre = rng.uniform(15.0, 50.0), rng.uniform(0.0, SIDE_M, 2) + dsm.bounds_m[:2]
        if np.linalg.norm(points_xy_m - centre, axis=1).min() < radius_m + 2 * MARGIN_M:
            continue
        if len(polygons) > len(circles):
            lat_deg, lon_deg = dsm.lat_lon_from_xy(centre[None])[0]
            circles.append(circle(lat_deg, lon_deg, radius_m, inclusion=False, where="bench"))
            continue
        turn = (np.arange(5) + rng.uniform(-0.3, 0.3, 5)) * math.tau / 5
        ring = centre + rng.uniform(0.5, 1.0, 5)[:, None] * radius_m * np.column_stack([np.cos(turn), np.sin(turn)])
        corners = [(float(lat), float(lon)) for lat, lon in dsm.lat_lon_from_xy(ring)]
        polygons.append(polygon(corners, inclusion=False, where="bench"))
    return Fence(tuple(polygons), tuple(circles))


if __name__ == "__main__":
    main()
