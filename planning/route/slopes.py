"""Where the surface is too steep to fly: raise the path, or slow down on it."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import PathParams
from planning.errors import ParameterError


def slope_limits(params: PathParams) -> tuple[float, float]:
    """Steepest climb and descent (metres of height per metre flown), both positive.

    At the maximum speed, not the mean: that is what the LSPB law cruises at (Melita 2020, section 6),
    so a path within these slopes keeps the vertical speeds everywhere.
    """
    limits = (params.max_climb_m_s, params.max_descent_m_s, params.max_speed_m_s)
    for name, value in zip(("climb rate", "descent rate", "speed"), limits, strict=True):
        if not (math.isfinite(value) and value > 0):
            raise ParameterError(f"The maximum {name} is {value} m/s.", advice="Give a positive number.")
    return params.max_climb_m_s / params.max_speed_m_s, params.max_descent_m_s / params.max_speed_m_s


def limited_heights(s_m: F64, surface_alt_m: F64, params: PathParams) -> F64:
    """The smallest profile (N,) nowhere below the surface that respects the slope limits."""
    climb, descent = slope_limits(params)
    return smallest_profile(s_m, surface_alt_m, climb=climb, descent=descent)


def smallest_profile(s_m: F64, surface_alt_m: F64, *, climb: float, descent: float) -> F64:
    """Smallest ``z >= surface`` with ``-descent <= dz/ds <= climb``, in linear time.

    Every sample holds up a cone: the path may sink from it by ``descent`` ahead and had to be no
    lower than ``climb`` behind. The profile is the supremum of the cones, and the supremum over one
    side is a running maximum in sheared coordinates. ``s_m`` (N,) must not decrease.
    """
    ahead = np.maximum.accumulate(surface_alt_m + descent * s_m) - descent * s_m
    behind = np.maximum.accumulate((ahead - climb * s_m)[::-1])[::-1] + climb * s_m
    # Shearing and back loses some 1e-13 m, which must not put the path below the surface.
    return np.maximum(behind, surface_alt_m)


def speed_caps(s_m: F64, alt_m: F64, params: PathParams) -> F64:
    """Largest horizontal speed (N - 1,) on each step at which the vertical speeds hold."""
    rise_m, step_m = np.diff(alt_m), np.diff(s_m)
    vertical_m_s = np.where(rise_m > 0, params.max_climb_m_s, params.max_descent_m_s)
    with np.errstate(divide="ignore", over="ignore"):
        return np.minimum(params.max_speed_m_s, vertical_m_s * step_m / np.abs(rise_m))
