"""At which speeds a vehicle returns home and lands by its own settings, and what is taken where they are not known."""

from __future__ import annotations

from dataclasses import dataclass

from planning.basics.plan_model import VehicleProfile

LAND_M_S = 0.5
LAND_SLOW_BELOW_M = 10.0
WAIT_S = 5.0


@dataclass(frozen=True, slots=True)
class ReturnSpeeds:
    """As set on the vehicle; None: not known."""

    level_m_s: float | None = None
    climb_m_s: float | None = None
    descent_m_s: float | None = None
    land_m_s: float | None = None
    """Below ``slow_below_m``."""
    slow_below_m: float | None = None
    """Above home."""
    wait_s: float | None = None
    """Over home, before it comes down."""
    height_m: float | None = None
    """Above home, at which it returns unless it is higher."""
    lands: bool = True
    """False: it stays in the air over home, until somebody lands it."""


@dataclass(frozen=True, slots=True)
class ReturnPace:
    """What the time of a way home is predicted by."""

    level_m_s: float
    climb_m_s: float
    descent_m_s: float
    land_m_s: float = LAND_M_S
    slow_below_m: float = LAND_SLOW_BELOW_M
    wait_s: float = WAIT_S
    height_m: float = 0.0


def planned_pace(profile: VehicleProfile) -> ReturnPace:
    """While only the profile is known: all at its limits."""
    return ReturnPace(
        profile.max_speed_m_s, profile.max_climb_m_s, profile.max_descent_m_s, height_m=profile.rtl_height_m
    )


def worse_pace(own: ReturnSpeeds, profile: VehicleProfile) -> ReturnPace:
    """The vehicle's own, never faster than the profile's limits, since nothing tells what that costs; of the level
    flight the profile's mean speed, where the vehicle's is not known; at the higher of both return heights."""
    return ReturnPace(
        _least(own.level_m_s, profile.max_speed_m_s, profile.mean_speed_m_s),
        _least(own.climb_m_s, profile.max_climb_m_s, profile.max_climb_m_s),
        _least(own.descent_m_s, profile.max_descent_m_s, profile.max_descent_m_s),
        own.land_m_s or LAND_M_S,
        LAND_SLOW_BELOW_M if own.slow_below_m is None else own.slow_below_m,
        WAIT_S if own.wait_s is None else own.wait_s,
        max(profile.rtl_height_m, own.height_m or 0.0),
    )


def _least(own_m_s: float | None, most_m_s: float, unknown_m_s: float) -> float:
    return min(most_m_s, own_m_s or unknown_m_s)
