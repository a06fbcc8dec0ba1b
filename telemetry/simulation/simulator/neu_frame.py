"""The simulated world's coordinates: metres north, east and up of the place where the vehicle was switched on."""

from __future__ import annotations

import math
from dataclasses import dataclass

Vec3 = tuple[float, float, float]
"""North, east, up."""

EQUATOR_M = 6_378_137.0
ECCENTRICITY_2 = 0.00669437999014


@dataclass(frozen=True, slots=True)
class NeuFrame:
    """A plane that touches WGS84 at the origin; good to some centimetres within kilometres."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float

    @property
    def metres_per_degree(self) -> tuple[float, float]:
        """(north, east), from the ellipsoid's radii of curvature at the origin."""
        s = math.sin(math.radians(self.lat_deg))
        w = math.sqrt(1 - ECCENTRICITY_2 * s * s)
        meridian, normal = EQUATOR_M * (1 - ECCENTRICITY_2) / w**3, EQUATOR_M / w
        return math.radians(meridian), math.radians(normal * math.cos(math.radians(self.lat_deg)))

    def neu_from_geodetic(self, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Vec3:
        north_m, east_m = self.metres_per_degree
        lon_away = math.remainder(lon_deg - self.lon_deg, 360.0)
        return (lat_deg - self.lat_deg) * north_m, lon_away * east_m, alt_amsl_m - self.alt_amsl_m

    def geodetic_from_neu(self, p_neu: Vec3) -> Vec3:
        """Latitude and longitude in degrees, height above sea level in metres."""
        north_m, east_m = self.metres_per_degree
        lon = math.remainder(self.lon_deg + p_neu[1] / east_m, 360.0)
        return self.lat_deg + p_neu[0] / north_m, lon, self.alt_amsl_m + p_neu[2]
