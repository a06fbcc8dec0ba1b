"""When something that moves straight on may be inside a cylinder around a vehicle, whatever both are uncertain by.

The cylinder grows: by what is not known of both, and by what either may turn meanwhile. Closed form, for many aircraft
once a second; ``planning.following.separation`` is for lines with corners.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from planning.errors import ParameterError

_LEVEL = 1e-12
"""Of a quadratic's first coefficient, in (m/s)^2: below it the curve is a line."""
Span = tuple[float, float]
"""From and until, in seconds."""


@dataclass(frozen=True, slots=True)
class Zone:
    """A cylinder that stands upright around the vehicle."""

    radius_m: float
    height_m: float
    """Above and below; infinite: it reaches to any height."""
    radius_spread_m_s: float = 0.0
    """What the radius grows by."""
    height_spread_m_s: float = 0.0

    def __post_init__(self) -> None:
        if not min(self.radius_m, self.height_m, self.radius_spread_m_s, self.height_spread_m_s) >= 0:
            raise ParameterError("A zone cannot be smaller than nothing, nor shrink.")


Enu = tuple[float, float, float]


def closest(offset_enu_m: Enu, velocity_enu_m_s: Enu) -> tuple[float, float]:
    """(distance, seconds from now) of the closest approach as seen from above; 0 seconds: it is not getting nearer.

    Both relative to the vehicle.
    """
    east_m, north_m, _ = offset_enu_m
    v_east, v_north, _ = velocity_enu_m_s
    speed2 = v_east * v_east + v_north * v_north
    towards = -(east_m * v_east + north_m * v_north)
    t_s = towards / speed2 if towards > 0 and speed2 > _LEVEL else 0.0
    return math.hypot(east_m + t_s * v_east, north_m + t_s * v_north), t_s


def first_inside(offset_enu_m: Enu, velocity_enu_m_s: Enu, zone: Zone, until_s: float) -> float | None:
    """Seconds from now, 0 when it may be inside by now; None when it is not until then."""
    beside = _inside_circle(offset_enu_m, velocity_enu_m_s, zone)
    low_s, high_s = _inside_layer(offset_enu_m[2], velocity_enu_m_s[2], zone)
    both = [(max(0.0, low_s, from_s), min(until_s, high_s, to_s)) for from_s, to_s in beside]
    return min((from_s for from_s, to_s in both if from_s <= to_s), default=None)


def _inside_circle(offset_enu_m: Enu, velocity_enu_m_s: Enu, zone: Zone) -> tuple[Span, ...]:
    """When |p + v t| <= R + s t, for t >= 0: both sides squared are a quadratic in t."""
    (x, y, _), (u, v, _) = offset_enu_m, velocity_enu_m_s
    radius, spread = zone.radius_m, zone.radius_spread_m_s
    a = u * u + v * v - spread * spread
    half_b = x * u + y * v - radius * spread
    c = x * x + y * y - radius * radius
    if abs(a) <= _LEVEL:
        return _below_zero(2 * half_b, c)
    rest = half_b * half_b - a * c
    if rest < 0:
        return () if a > 0 else ((0.0, math.inf),)
    # Of the two roots the one that no digits are lost of, and the other one by their product.
    q = -(half_b + math.copysign(math.sqrt(rest), half_b))
    first, second = sorted((q / a, c / q if q else 0.0))
    return ((first, second),) if a > 0 else ((-math.inf, first), (second, math.inf))


def _inside_layer(up_m: float, climb_m_s: float, zone: Zone) -> Span:
    """When -(H + h t) <= z + w t <= H + h t."""
    if math.isinf(zone.height_m):
        return -math.inf, math.inf
    height, spread = zone.height_m, zone.height_spread_m_s
    low_s, high_s = -math.inf, math.inf
    for slope, level in ((climb_m_s - spread, up_m - height), (-climb_m_s - spread, -up_m - height)):
        for from_s, to_s in _below_zero(slope, level) or ((math.inf, -math.inf),):
            low_s, high_s = max(low_s, from_s), min(high_s, to_s)
    return low_s, high_s


def _below_zero(slope: float, level: float) -> tuple[Span, ...]:
    """Where slope t + level <= 0."""
    if slope == 0:
        return ((-math.inf, math.inf),) if level <= 0 else ()
    crossing_s = -level / slope
    return ((-math.inf, crossing_s),) if slope > 0 else ((crossing_s, math.inf),)
