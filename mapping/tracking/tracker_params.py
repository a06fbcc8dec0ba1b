"""What a tracker is told about its radar and its objects, and what it says of each object."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal, get_args

import numpy as np

from mapping.errors import ParameterError
from mapping.geometry.arrays import F64

Coordinates = Literal["cartesian", "polar"]


@dataclass(frozen=True, slots=True)
class TrackerParams:
    """Of a radar and of the objects before it; the defaults are an AWR1843's. Errors are one sigma.

    The paper found its thresholds, gates and noises by trial (Wessendorp 2021, IV-A) and prints none of them.
    """

    coordinates: Coordinates = "cartesian"
    """Of the filters' states. polar: range, bearing and their rates, as in the paper; cartesian: place and velocity
    over ground, in which an object that flies straight past needs no made-up acceleration."""
    range_sigma_m: float = 0.15
    bearing_sigma_rad: float = math.radians(1.0)
    """Up to ``bearing_edge_rad`` to either side of the nose."""
    bearing_edge_rad: float = math.radians(45.0)
    bearing_edge_sigma_rad: float = math.radians(2.0)
    """Beyond that."""
    radial_speed_sigma_m_s: float = 0.2
    radial_speed_folded_m_s: float = math.inf
    """Radial speeds that differ by this look the same. Objects that may be slower or faster begin as several."""
    extent_m: float = 0.3
    """The part of an object that echoes wanders by so much."""
    acceleration_m_s2: float = 2.0
    """Of the objects, and of whatever else the straight line does not hold."""
    speed_m_s: float = 5.0
    """Over ground, of an object of which nothing but its radial speed is known; three times as much is believed."""
    detection_probability: float = 0.997
    """Sets the price of a miss: with eqs 5 and 6 as they stand, no detection farther off than sqrt(-2 log(1 - P_D))
    sigma is ever taken. With 0.997 that is the whole gate; the 0.9 of a real radar would refuse one in five."""
    gate: float = 11.345
    """Squared sigmas: 99 % of an object's own detections, three numbers each."""
    birth: float = 0.7
    """Largest variance of the place over that of one detection below which a candidate becomes an object."""
    birth_updates: int = 3
    """Detections that it takes at least."""
    death: float = 9.0
    """The same ratio above which it is forgotten."""
    longest_gap_s: float = 5.0
    """Between two frames; after a longer one everything is forgotten."""
    apart_m: float = 0.75
    """A detection this near to an object that was seen in the same frame is part of it and begins nothing."""
    most: int = 2000
    """Objects and candidates."""

    def __post_init__(self) -> None:
        if self.coordinates not in get_args(Coordinates):
            raise ParameterError(
                f'There are no coordinates "{self.coordinates}".',
                where="coordinates",
                advice=f"Choose one of {', '.join(get_args(Coordinates))}.",
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, str) and not value >= _LEAST.get(field.name, 0.0):
                raise ParameterError(f"{value} is too small.", where=field.name, advice="Give a number above 0.")
        if not self.detection_probability < 1.0:
            raise ParameterError(
                f"A radar that detects with a probability of {self.detection_probability} is none.",
                where="detection_probability",
                advice="Give a number above 0 and below 1.",
            )
        if not self.birth < self.death:
            raise ParameterError(
                f"Objects are born below {self.birth} and die above {self.death}.",
                where="birth",
                advice="Give a birth below the death.",
            )

    @property
    def miss_cost(self) -> float:
        """-l(i,0) of eq. 5."""
        return -math.log1p(-self.detection_probability)  # Wessendorp 2021, eq. 5

    def noise(self) -> F64:
        """(7,) As the kernels take it: range, bearing, edge, bearing beyond, radial speed, extent, folding."""
        return np.array(
            [
                self.range_sigma_m,
                self.bearing_sigma_rad,
                self.bearing_edge_rad,
                self.bearing_edge_sigma_rad,
                self.radial_speed_sigma_m_s,
                self.extent_m,
                self.radial_speed_folded_m_s,
            ]
        )


_SMALL = 1e-6
_LEAST = dict.fromkeys(
    (
        "range_sigma_m",
        "bearing_sigma_rad",
        "bearing_edge_sigma_rad",
        "radial_speed_sigma_m_s",
        "radial_speed_folded_m_s",
        "speed_m_s",
        "detection_probability",
        "gate",
        "birth",
    ),
    _SMALL,
) | {"birth_updates": 1, "most": 1}


@dataclass(frozen=True, slots=True)
class TrackState:
    """One object, or a candidate for one, at the time of the newest frame."""

    id: int
    """Never used twice by a tracker."""
    position_enu_m: F64
    """(2,)"""
    velocity_enu_m_s: F64
    """(2,) Over ground."""
    covariance: F64
    """(4, 4) Of east, north and their velocities."""
    age_s: float
    """Since its first detection."""
    updates: int
    """Detections that it was given."""
    seen: bool
    """In the newest frame."""
    confirmed: bool
    """An object; False: a candidate, which may be nothing at all."""
