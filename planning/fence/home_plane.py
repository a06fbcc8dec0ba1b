"""The tangent plane at home, in which fences are judged and ways around them are laid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from planning.fence.fence_model import FenceCircle, FencePolygon, LatLon

FARTHEST_M = 200_000.0
"""From home: in the tangent plane farther places are no longer where they are."""
BEND_RADIUS_M = 6_335_000.0
"""The Earth's smallest radius of curvature."""


@dataclass(frozen=True, slots=True)
class HomePlane:
    frame: LocalFrame
    lat_deg: float
    """Of home, without its sign."""

    def xy_m(self, lat_lon_deg: object) -> F64:
        """(N, 2) degrees -> (N, 2) east and north of home."""
        lat_deg, lon_deg = np.asarray(lat_lon_deg, np.float64).reshape(-1, 2).T
        return self.frame.to_tangent(lat_deg, lon_deg, np.zeros(len(lat_deg)))[:, :2]

    def lat_lon_deg(self, xy_m: F64) -> F64:
        """(N, 2) east and north of home -> (N, 2) degrees."""
        return self.frame.to_geodetic(np.column_stack([xy_m, np.zeros(len(xy_m))]))[:, :2]

    def reach_m(self, shape: FencePolygon | FenceCircle) -> float:
        """From home to the farthest corner or the centre, through the Earth: also right on its other side."""
        places = shape.corners_lat_lon_deg if isinstance(shape, FencePolygon) else (shape.centre_lat_lon_deg,)
        lat_deg, lon_deg = np.array(places).T
        return float(np.linalg.norm(self.frame.to_tangent(lat_deg, lon_deg, np.zeros(len(lat_deg))), axis=1).max())

    def bend_m(self, longest_m: float) -> float:
        """How far two straight lines of this length, each straight in a frame of its own, can be apart."""
        steep = math.tan(math.radians(min(self.lat_deg + 1.0, 85.0)))
        return 2.0 * longest_m**2 * max(steep, longest_m / BEND_RADIUS_M) / (8.0 * BEND_RADIUS_M)


def plane_at(home_lat_lon_deg: LatLon) -> HomePlane:
    lat_deg, lon_deg = home_lat_lon_deg
    return HomePlane(LocalFrame(lat_deg, lon_deg, 0.0), abs(lat_deg))


def longest_m(polygons_m: F64) -> float:
    """Of the sides of (K, N, 2) polygons."""
    return float(np.linalg.norm(polygons_m - np.roll(polygons_m, 1, axis=1), axis=2).max())
