"""What may be asked of a vehicle in the air, from where, and the certified line that comes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mapping.geometry.arrays import F64
from planning.certificate.certificate_model import Certificate, ClearanceParams
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint

LatLon = tuple[float, float]
Problem = Literal["way", "return"]
"""The way itself is not clear; or it is, but the vehicle's own return from it would not be."""
HEIGHTS_M, RADII_M, LAPS = (0.5, 500.0), (3.0, 500.0), (1, 50)
"""What may be asked for."""


@dataclass(frozen=True, slots=True)
class Here:
    """Where the vehicle is, and where its heights begin."""

    lat_lon_deg: LatLon
    alt_rel_home_m: float
    home_lat_lon_deg: LatLon


@dataclass(frozen=True, slots=True)
class TakeOff:
    """Straight up from where it stands."""

    alt_rel_home_m: float


@dataclass(frozen=True, slots=True)
class GoTo:
    """To a place; without one it stays over its own."""

    height_m: float
    """Above the surface there."""
    lat_lon_deg: LatLon | None = None


@dataclass(frozen=True, slots=True)
class Join:
    """To a place of a planned line, as high as that, or higher where the way there asks for it."""

    lat_lon_deg: LatLon
    alt_rel_home_m: float


@dataclass(frozen=True, slots=True)
class Look:
    """The nose turns to a place; the vehicle stays where it is."""

    lat_lon_deg: LatLon


@dataclass(frozen=True, slots=True)
class Orbit:
    """Around a place, looking at it."""

    lat_lon_deg: LatLon
    radius_m: float
    height_m: float
    """Above the surface at the place; the circle is level."""
    laps: int = 1
    clockwise: bool = True


@dataclass(frozen=True, slots=True)
class ToHome:
    """Over home at ``height_m`` above it, then down."""

    height_m: float


@dataclass(frozen=True, slots=True)
class Rally:
    """The same at a rally point."""

    point: RallyPoint
    height_m: float
    """Above the surface there."""


@dataclass(frozen=True, slots=True)
class Back:
    """Along the way that was flown, backwards, at the heights that were flown; then down at home."""

    flown: tuple[tuple[float, float, float], ...]
    """(lat_deg, lon_deg, alt_rel_home_m), the first at the take-off, the last near the vehicle."""


Wish = TakeOff | GoTo | Join | Look | Orbit | ToHome | Rally | Back
RETURNS = (ToHome, Rally, Back)


@dataclass(frozen=True, slots=True)
class Demand:
    """What is demanded of a guided way."""

    clearance: ClearanceParams
    speed_m_s: float
    climb_m_s: float
    descent_m_s: float
    fence: Fence = NO_FENCE
    rally: tuple[RallyPoint, ...] = ()


@dataclass(frozen=True, slots=True)
class GuidedWay:
    """The lowest line of its kind that is certified; where none is, the one that was tried first, and why not."""

    points_m: F64
    """(K, 3) x, y, alt_dsm in the model's CRS, from where the vehicle is to where it ends."""
    places: tuple[tuple[float, float, float], ...]
    """(K,) lat_deg, lon_deg, alt_rel_home_m of the same."""
    certificate: Certificate
    raised_m: float
    """So much higher than asked it ends."""
    rises_m: float
    """So far it first climbs straight up, out of where it is nearer than it must be; 0 where it is not."""
    length_m: float
    t_s: F64
    """(K,) predicted seconds until it is there, from the first place on; never falling."""
    problem: Problem | None
    """None: it may be flown."""
    turns: int = 0
    """Places where it turns to pass beside a fence."""

    @property
    def clearance_m(self) -> float:
        """Smallest distance to the surface, the ground at home at its worse end."""
        return self.certificate.kept_m

    @property
    def seconds(self) -> float:
        return float(self.t_s[-1])

    @property
    def reasons(self) -> tuple[str, ...]:
        """What speaks against it, or what is to be known of it."""
        return tuple(reason.text for reason in self.certificate.reasons)
