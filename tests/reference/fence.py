"""Whether a flight keeps out of what a fence forbids, by brute force: thousands of places, each held to every shape.

Shares nothing with ``planning.fence``: places come from pyproj's azimuthal projection about home, a polygon's inside
from the sum of the angles under which its edges are seen.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from pyproj import Transformer

from planning.fence.fence_model import Fence, FencePolygon

Places = np.ndarray


def plane_about(home_lat_lon_deg: tuple[float, float]) -> Transformer:
    lat_deg, lon_deg = home_lat_lon_deg
    return Transformer.from_crs(
        "EPSG:4326", f"+proj=aeqd +lat_0={lat_deg} +lon_0={lon_deg} +datum=WGS84", always_xy=True
    )


def xy_of(plane: Transformer, lat_lon_deg: object) -> Places:
    lat_deg, lon_deg = np.array(lat_lon_deg, dtype=float).reshape(-1, 2).T
    return np.column_stack(plane.transform(lon_deg, lat_deg))


def swept_places(line_m: Places, targets_m: Places, step_m: float) -> Places:
    """Places of the line, and of the straight ways from each of them to each target."""
    line = np.vstack([_between(a, b, step_m) for a, b in pairwise(line_m)])
    return np.vstack([line, *(_between(a, target, step_m) for target in targets_m for a in line)])


def nearest_m(fence: Fence, places_m: Places, plane: Transformer) -> float:
    """Smallest distance of any place to what is forbidden; 0 within it."""
    found = [np.inf]
    for polygon in fence.polygons:
        found.append(_to_polygon(polygon, places_m, xy_of(plane, polygon.corners_lat_lon_deg)))
    for circle in fence.circles:
        away_m = np.linalg.norm(places_m - xy_of(plane, circle.centre_lat_lon_deg)[0], axis=1)
        outside_m = circle.radius_m - away_m if circle.inclusion else away_m - circle.radius_m
        found.append(max(0.0, float(outside_m.min())))
    return min(found)


def _to_polygon(polygon: FencePolygon, places_m: Places, corners_m: Places) -> float:
    angle, edge_m = np.zeros(len(places_m)), np.full(len(places_m), np.inf)
    for p, q in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        u, v = p - places_m, q - places_m
        angle += np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], np.sum(u * v, axis=1))
        along = q - p
        share = np.clip((places_m - p) @ along / (along @ along), 0.0, 1.0)
        edge_m = np.minimum(edge_m, np.linalg.norm(p + share[:, None] * along - places_m, axis=1))
    inside = np.abs(angle) > np.pi
    return float(np.where(inside == polygon.inclusion, edge_m, 0.0).min())


def _between(a: Places, b: Places, step_m: float) -> Places:
    parts = max(1, int(np.ceil(np.linalg.norm(b - a) / step_m)))
    return a + np.linspace(0.0, 1.0, parts + 1)[:, None] * (b - a)
