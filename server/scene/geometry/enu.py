"""From a map's east, north, up to the surface model on show: home stands on the model's ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame
from planning.terrain.dsm import Dsm
from telemetry.topics.obstacles import MapOrigin


@dataclass(frozen=True, slots=True)
class EnuPlacing:
    """One map origin on one surface model."""

    dsm: Dsm
    origin: MapOrigin
    home_alt_dsm_m: float

    @staticmethod
    def of(dsm: Dsm, origin: MapOrigin | None) -> EnuPlacing | None:
        """None where home does not lie on known ground of the model."""
        if origin is None:
            return None
        xy_m = dsm.xy_from_lat_lon(np.array([[origin.lat_deg, origin.lon_deg]]))
        home_m = float(dsm.elevation_at(xy_m)[0]) if np.isfinite(xy_m).all() else math.nan
        return EnuPlacing(dsm, origin, home_m) if math.isfinite(home_m) else None

    def model_from_enu(self, points_enu_m: F64) -> F64:
        """(N, 3) east, north, up -> (N, 3) x, y, alt_dsm."""
        points = np.asarray(points_enu_m, dtype=np.float64).reshape(-1, 3)
        frame = LocalFrame(self.origin.lat_deg, self.origin.lon_deg, self.origin.alt_amsl_m)
        xy_m = self.dsm.xy_from_lat_lon(frame.to_geodetic(points)[:, :2])
        return np.column_stack([xy_m, points[:, 2] + self.home_alt_dsm_m])

    def turn_rad(self, at_enu_m: F64) -> float:
        """Counter-clockwise, from the model's x axis to east there: a projection's north is not true north."""
        here, east = self.model_from_enu(np.stack([at_enu_m, at_enu_m + np.array([10.0, 0.0, 0.0])]))
        return math.atan2(east[1] - here[1], east[0] - here[0])
