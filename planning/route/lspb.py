"""Linear Segment with Parabolic Blends: the timing law of one straight segment."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import PathParams
from planning.errors import ParameterError


@dataclass(frozen=True, slots=True)
class Lspb:
    """A segment flown from rest to rest: constant acceleration, cruise, constant deceleration."""

    length_m: float
    duration_s: float
    """t_f"""
    blend_s: float
    """t_b, the same at both ends; at most half of ``duration_s``."""
    peak_m_s: float
    """Cruise speed."""

    @property
    def accel_m_s2(self) -> float:
        """Magnitude during the blends."""
        return self.peak_m_s / self.blend_s

    def position_m(self, t_s: F64) -> F64:
        """Distance from the segment's start; ``t_s`` any shape, clipped to the segment's duration."""
        t = np.clip(t_s, 0.0, self.duration_s)
        rising = 0.5 * self.accel_m_s2 * np.minimum(t, self.blend_s) ** 2
        level = self.peak_m_s * np.clip(t - self.blend_s, 0.0, self.duration_s - 2 * self.blend_s)
        left = np.minimum(self.duration_s - t, self.blend_s)
        return rising + level + 0.5 * self.accel_m_s2 * (self.blend_s**2 - left**2)

    def speed_m_s(self, t_s: F64) -> F64:
        """Speed; zero outside the segment's duration."""
        t = np.clip(t_s, 0.0, self.duration_s)
        return np.minimum(self.peak_m_s, self.accel_m_s2 * np.minimum(t, self.duration_s - t))

    def acceleration_m_s2(self, t_s: F64) -> F64:
        """Acceleration along the segment; zero outside its duration."""
        t = np.asarray(t_s, dtype=np.float64)
        speeding = (t >= 0) & (t < self.blend_s)
        braking = (t > self.duration_s - self.blend_s) & (t <= self.duration_s)
        return self.accel_m_s2 * (speeding.astype(np.float64) - braking)

    def time_s(self, position_m: F64) -> F64:
        """Inverse of ``position_m``, clipped to the segment."""
        s = np.clip(position_m, 0.0, self.length_m)
        blend_m = 0.5 * self.peak_m_s * self.blend_s
        rising = np.sqrt(2 * np.minimum(s, blend_m) / self.accel_m_s2)
        level = np.clip(s - blend_m, 0.0, self.length_m - 2 * blend_m) / self.peak_m_s
        left_m = np.minimum(self.length_m - s, blend_m)
        return np.where(
            self.length_m - s >= blend_m,
            rising + level,
            self.duration_s - np.sqrt(2 * np.maximum(left_m, 0.0) / self.accel_m_s2),
        )


def lspb(length_m: float, params: PathParams) -> Lspb:
    """The law for a segment of ``length_m``.

    Melita 2020, section 6: ``t_f = L / v_mean``, ``t_b = t_f - L / v_max``, ``a = v_max / t_b``.
    Where ``a`` would exceed the vehicle's limit we deviate: t_f grows until ``a`` is the limit,
    still reaching v_max; where the segment is too short for that, the speed peaks at
    ``sqrt(L a)`` half way. The three laws join continuously.
    """
    check_speeds(params)
    if not (math.isfinite(length_m) and length_m > 0):
        raise ParameterError(f"A segment's length is {length_m} m.", advice="Give two points that differ.")
    peak_m_s, limit_m_s2 = params.max_speed_m_s, params.max_accel_m_s2
    blend_s = length_m / params.mean_speed_m_s - length_m / peak_m_s  # Melita 2020, section 6
    if peak_m_s <= limit_m_s2 * blend_s:
        return Lspb(length_m, length_m / params.mean_speed_m_s, blend_s, peak_m_s)
    peak_m_s = min(peak_m_s, math.sqrt(length_m * limit_m_s2))
    blend_s = peak_m_s / limit_m_s2
    return Lspb(length_m, length_m / peak_m_s + blend_s, blend_s, peak_m_s)


def check_speeds(params: PathParams) -> None:
    """Raise ``ParameterError`` unless ``v_mean < v_max <= 2 v_mean`` and the acceleration is positive."""
    mean, top, accel = params.mean_speed_m_s, params.max_speed_m_s, params.max_accel_m_s2
    for name, value in (("mean speed", mean), ("maximum speed", top), ("acceleration limit", accel)):
        if not (math.isfinite(value) and value > 0):
            raise ParameterError(f"The {name} is {value}.", advice="Give a positive number.")
    if not mean < top <= 2 * mean:
        raise ParameterError(
            f"A mean speed of {mean:g} m/s and a maximum speed of {top:g} m/s contradict each other:"
            " from rest to rest the maximum lies above the mean and is at most twice the mean.",
            advice=f"Give a maximum speed above {mean:g} and up to {2 * mean:g} m/s,"
            f" or a mean speed from {top / 2:g} to below {top:g} m/s.",
        )
