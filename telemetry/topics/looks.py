"""What a sensor's newest frame showed, to be looked at beside its map: nothing is searched or planned in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.topics.obstacles import MapOrigin

REACH_CM = 32_767
"""Of a cloud's points from where it was seen."""


@dataclass(frozen=True, slots=True)
class RadarLook:
    """All targets of a frame in the radar's own frame (Miccinesi 2022, fig. 12), and the gate that they met."""

    t_mono_s: float
    t_utc_s: float
    xyz_m: bytes
    """(N, 3) little-endian float32: x right, y ahead, z up"""
    kept: bytes
    """(N,) uint8, 1: through the gate"""
    azimuth_rad: float
    low_rad: float
    high_rad: float
    nearest_m: float
    farthest_m: float


@dataclass(frozen=True, slots=True)
class CloudLook:
    """Some of a cloud's points, as they lie in the map."""

    t_mono_s: float
    t_utc_s: float
    origin: MapOrigin
    at_enu_m: tuple[float, float, float]
    """From where it was seen."""
    points_cm: bytes
    """(N, 3) little-endian int16 from there, east, north, up"""


def packed_cm(points_m: F64) -> bytes:
    """(N, 3) metres, none beyond ``REACH_CM``."""
    return np.rint(np.asarray(points_m) * 100.0).astype("<i2").tobytes()


def points_enu_m(look: CloudLook) -> F64:
    """(N, 3)"""
    return np.frombuffer(look.points_cm, "<i2").reshape(-1, 3) / 100.0 + np.array(look.at_enu_m)
