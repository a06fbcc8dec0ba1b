"""Frames: geodetic to local metres, and body to local metres.

Body: x right, y forward, z up. Map: east, north, up. Heading counts clockwise from north, pitch is positive nose up,
roll right wing down. Quaternions are (w, x, y, z), unit, body to map.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64

EQUATOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)
MEAN_RADIUS_M = 6_371_008.8
"""Of the Earth (IUGG): the r of Miccinesi 2022, eq. 2."""

Degrees = TypeVar("Degrees", float, F64)


def offset_m(origin_deg: tuple[float, float], lat_deg: Degrees, lon_deg: Degrees) -> tuple[Degrees, Degrees]:
    """East and north in metres of places near the origin (latitude, longitude), on the sphere of ``SphereFrame``.

    For a step of a flight and for "is it there": off by up to 0.6 % of the distance. A map's frame is ``LocalFrame``.
    """
    metres = math.radians(MEAN_RADIUS_M)
    east_deg = (lon_deg - origin_deg[1] + 180.0) % 360.0 - 180.0
    return east_deg * (metres * math.cos(math.radians(origin_deg[0]))), (lat_deg - origin_deg[0]) * metres


def moved_deg(origin_deg: tuple[float, float], east_m: float, north_m: float) -> tuple[float, float]:
    """The place that ``offset_m`` puts there."""
    metres = math.radians(MEAN_RADIUS_M)
    east_deg = east_m / (metres * math.cos(math.radians(origin_deg[0])))
    return origin_deg[0] + north_m / metres, origin_deg[1] + east_deg


def apart_m(a_deg: tuple[float, float], b_deg: tuple[float, float]) -> float:
    """Between two places near each other (latitude, longitude), as seen from above."""
    return math.hypot(*offset_m(a_deg, *b_deg))


def _columns(lat_deg: ArrayLike, lon_deg: ArrayLike, alt_m: ArrayLike) -> tuple[F64, F64, F64]:
    lat, lon, alt = np.broadcast_arrays(*(np.atleast_1d(np.asarray(a, np.float64)) for a in (lat_deg, lon_deg, alt_m)))
    return np.radians(lat), np.radians(lon), alt


def ecef_from_geodetic(lat_deg: ArrayLike, lon_deg: ArrayLike, alt_m: ArrayLike) -> F64:
    """WGS84 latitude, longitude, height above the ellipsoid -> (N, 3) Earth-centred metres."""
    lat, lon, alt = _columns(lat_deg, lon_deg, alt_m)
    normal = EQUATOR_M / np.sqrt(1 - ECCENTRICITY_2 * np.sin(lat) ** 2)
    across = (normal + alt) * np.cos(lat)
    return np.column_stack(
        [across * np.cos(lon), across * np.sin(lon), (normal * (1 - ECCENTRICITY_2) + alt) * np.sin(lat)]
    )


def geodetic_from_ecef(ecef_m: F64) -> F64:
    """(N, 3) Earth-centred metres -> (N, 3) latitude, longitude in degrees, height above the ellipsoid.

    Fixed point of the latitude's own equation, without its singularity at the poles; good to less than a micrometre
    for heights of aircraft.
    """
    x, y, z = np.asarray(ecef_m, np.float64).reshape(-1, 3).T
    across = np.hypot(x, y)
    lat = np.arctan2(z, across * (1 - ECCENTRICITY_2))
    for _ in range(6):
        normal = EQUATOR_M / np.sqrt(1 - ECCENTRICITY_2 * np.sin(lat) ** 2)
        lat = np.arctan2(z + ECCENTRICITY_2 * normal * np.sin(lat), across)
    normal = EQUATOR_M / np.sqrt(1 - ECCENTRICITY_2 * np.sin(lat) ** 2)
    alt = across * np.cos(lat) + z * np.sin(lat) - EQUATOR_M**2 / normal
    return np.column_stack([np.degrees(lat), np.degrees(np.arctan2(y, x)), alt])


@dataclass(frozen=True)
class LocalFrame:
    """East and north on the WGS84 ellipsoid's tangent plane at home; up is the height above home.

    A tangent plane leaves the level surface (8 cm at 1 km, 2 m at 5 km), and missions, surface models and autopilots
    count heights along the level surface. ``to_enu`` therefore counts up as they do; ``to_tangent`` is the strict
    topocentric frame. Which vertical datum ``alt_m`` is in does not matter as long as it is one and the same.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float

    def to_tangent(self, lat_deg: ArrayLike, lon_deg: ArrayLike, alt_m: ArrayLike) -> F64:
        """Degrees and metres, each (N,) or a number -> (N, 3) strictly topocentric east, north, up."""
        return (ecef_from_geodetic(lat_deg, lon_deg, alt_m) - self._origin_ecef) @ self._axes_ecef.T

    def from_tangent(self, p_tangent: ArrayLike) -> F64:
        """(N, 3) strictly topocentric metres -> (N, 3) latitude, longitude in degrees, altitude."""
        p = np.asarray(p_tangent, np.float64).reshape(-1, 3)
        return geodetic_from_ecef(p @ self._axes_ecef + self._origin_ecef)

    def to_enu(self, lat_deg: ArrayLike, lon_deg: ArrayLike, alt_m: ArrayLike) -> F64:
        """Degrees and metres, each (N,) or a number -> (N, 3) east, north, height above home."""
        p = self.to_tangent(lat_deg, lon_deg, alt_m)
        p[:, 2] = np.broadcast_to(np.asarray(alt_m, np.float64), (len(p),)) - self.alt_m
        return p

    def to_geodetic(self, p_enu: ArrayLike) -> F64:
        """(N, 3) east, north, height above home -> (N, 3) latitude, longitude in degrees, altitude."""
        p = np.array(np.asarray(p_enu, np.float64).reshape(-1, 3))
        wanted_m = p[:, 2] + self.alt_m
        for _ in range(3):  # up of the tangent plane at which the height is the wanted one
            p[:, 2] += wanted_m - self.from_tangent(p)[:, 2]
        return self.from_tangent(p)

    @cached_property
    def _origin_ecef(self) -> F64:
        return ecef_from_geodetic(self.lat_deg, self.lon_deg, self.alt_m)

    @cached_property
    def _axes_ecef(self) -> F64:
        sa, ca = math.sin(math.radians(self.lat_deg)), math.cos(math.radians(self.lat_deg))
        so, co = math.sin(math.radians(self.lon_deg)), math.cos(math.radians(self.lon_deg))
        return np.array([[-so, co, 0.0], [-sa * co, -sa * so, ca], [ca * co, ca * so, sa]])


@dataclass(frozen=True, slots=True)
class SphereFrame:
    """The paper's local frame (Miccinesi 2022, eqs 1-2): a sphere of the Earth's mean radius.

    Within 1 km of home it is wrong by up to 0.6 % of the distance, since the ellipsoid's own radii of curvature
    differ from the mean by as much.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float

    def to_enu(self, lat_deg: ArrayLike, lon_deg: ArrayLike, alt_m: ArrayLike) -> F64:
        """Degrees and metres, each (N,) or a number -> (N, 3) east, north, up."""
        lat, lon, alt = _columns(lat_deg, lon_deg, alt_m)
        d_lat, d_lon = lat - math.radians(self.lat_deg), lon - math.radians(self.lon_deg)  # Miccinesi 2022, eq. 1
        east_m = MEAN_RADIUS_M * np.sin(d_lon) * np.cos(lat)  # Miccinesi 2022, eq. 2
        return np.column_stack([east_m, MEAN_RADIUS_M * np.sin(d_lat), alt - self.alt_m])

    def to_geodetic(self, p_enu: ArrayLike) -> F64:
        """(N, 3) metres -> (N, 3) latitude, longitude in degrees, altitude."""
        e, n, u = np.asarray(p_enu, np.float64).reshape(-1, 3).T
        lat = math.radians(self.lat_deg) + np.arcsin(n / MEAN_RADIUS_M)
        lon = math.radians(self.lon_deg) + np.arcsin(e / (MEAN_RADIUS_M * np.cos(lat)))
        return np.column_stack([np.degrees(lat), np.degrees(lon), u + self.alt_m])


def heading_rotation(heading_rad: float) -> F64:
    """R_enu_body of the heading alone (Miccinesi 2022, eq. 4: the inverse of Rz(psi))."""
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])  # Miccinesi 2022, eq. 4


def attitude_rotation(heading_rad: float, pitch_rad: float, roll_rad: float) -> F64:
    """R_enu_body = Rz(-heading) Rx(pitch) Ry(roll).

    Stands for eq. 3 of Miccinesi 2022, two entries of which are misprinted: its determinant is not 1.
    """
    cp, sp = math.cos(pitch_rad), math.sin(pitch_rad)
    cr, sr = math.cos(roll_rad), math.sin(roll_rad)
    nose_up = np.array([[1.0, 0.0, 0.0], [0.0, cp, -sp], [0.0, sp, cp]])
    right_down = np.array([[cr, 0.0, sr], [0.0, 1.0, 0.0], [-sr, 0.0, cr]])
    return heading_rotation(heading_rad) @ nose_up @ right_down  # Miccinesi 2022, eq. 3


def attitude_of(R_enu_body: F64) -> tuple[float, float, float]:
    """Heading, pitch and roll: the inverse of ``attitude_rotation``."""
    R = R_enu_body
    pitch_rad = math.asin(min(1.0, max(-1.0, float(R[2, 1]))))
    if math.hypot(R[2, 0], R[2, 2]) < 1e-9:  # straight up or down: only heading and roll together are known
        return math.atan2(-R[1, 0], R[0, 0]) % (2 * math.pi), pitch_rad, 0.0
    return quaternions.heading(R), pitch_rad, math.atan2(-R[2, 0], R[2, 2])
