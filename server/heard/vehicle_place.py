"""Where a vehicle is on a surface model: its height above home counts from the model's height at its actual home."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from planning.terrain.dsm import Dsm
from planning.terrain.vertical_datum import is_amsl
from telemetry.topics.vehicle import VehicleState


class Placer:
    """One surface model; remembers the height at home, which seldom moves."""

    def __init__(self, dsm: Dsm) -> None:
        self.dsm = dsm
        self._home_alt_dsm_m = lru_cache(maxsize=8)(self._ground_alt_dsm_m)

    def place(self, state: VehicleState) -> F64 | None:
        """(3,) x, y, alt_dsm in the model's coordinates; None where it cannot be told."""
        if state.lat_deg is None or state.lon_deg is None:
            return None
        alt_dsm_m = self._alt_dsm_m(state)
        if alt_dsm_m is None:
            return None
        xy_m = self.dsm.xy_from_lat_lon(np.array([[state.lat_deg, state.lon_deg]]))[0]
        place = np.array([xy_m[0], xy_m[1], alt_dsm_m])
        return place if np.isfinite(place).all() else None

    def places(self, states: Sequence[VehicleState]) -> F64:
        """(N, 3) of those of the states that can be placed, in their order."""
        known = [(s, alt_m) for s in states if s.lat_deg is not None and (alt_m := self._alt_dsm_m(s)) is not None]
        lat_lon_deg = np.array([(s.lat_deg, s.lon_deg) for s, _ in known], dtype=np.float64).reshape(-1, 2)
        points = np.column_stack([self.dsm.xy_from_lat_lon(lat_lon_deg), [alt_m for _, alt_m in known]])
        return points[np.isfinite(points).all(axis=1)]

    def line(self, places: Sequence[tuple[float, float, float]], state: VehicleState) -> F64:
        """(K, 3) of (lat_deg, lon_deg, alt_rel_home_m); nothing where the model does not know the ground at home."""
        if state.home_lat_deg is None or state.home_lon_deg is None:
            return np.zeros((0, 3))
        given = np.array(places, np.float64).reshape(-1, 3)
        alt_m = self._home_alt_dsm_m(state.home_lat_deg, state.home_lon_deg) + given[:, 2]
        points = np.column_stack([self.dsm.xy_from_lat_lon(given[:, :2]), alt_m])
        return points if np.isfinite(points).all() else points[:0]

    def home(self, state: VehicleState) -> F64 | None:
        """(3,) the vehicle's actual home on the model's ground."""
        if state.home_lat_deg is None or state.home_lon_deg is None:
            return None
        xy_m = self.dsm.xy_from_lat_lon(np.array([[state.home_lat_deg, state.home_lon_deg]]))[0]
        place = np.array([xy_m[0], xy_m[1], self._home_alt_dsm_m(state.home_lat_deg, state.home_lon_deg)])
        return place if np.isfinite(place).all() else None

    def _alt_dsm_m(self, state: VehicleState) -> float | None:
        if state.alt_rel_home_m is not None and state.home_lat_deg is not None and state.home_lon_deg is not None:
            home_m = self._home_alt_dsm_m(state.home_lat_deg, state.home_lon_deg)
            if math.isfinite(home_m):
                return home_m + state.alt_rel_home_m
        if state.alt_amsl_m is not None and is_amsl(self.dsm.vertical_datum):
            return state.alt_amsl_m
        return None

    def _ground_alt_dsm_m(self, lat_deg: float, lon_deg: float) -> float:
        return float(self.dsm.elevation_at(self.dsm.xy_from_lat_lon(np.array([[lat_deg, lon_deg]])))[0])


def home_distance_bearing(state: VehicleState) -> tuple[float | None, float | None]:
    """Metres from the vehicle to its home, and degrees clockwise from north; on the sphere."""
    if state.lat_deg is None or state.lon_deg is None or state.home_lat_deg is None or state.home_lon_deg is None:
        return None, None
    east_m, north_m = offset_m((state.lat_deg, state.lon_deg), state.home_lat_deg, state.home_lon_deg)
    return math.hypot(east_m, north_m), math.degrees(math.atan2(east_m, north_m)) % 360.0
