"""The path of the camera's own SLAM: where it breaks off, so that what was seen before and after is never mixed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64

JUMP_M, JUMP_RAD = 0.5, math.radians(10.0)
"""Beyond what a vehicle can do: a voxel of the camera's map, and as much again 3 m ahead of it."""
ACCELERATION_M_S2, TURN_RAD_S = 10.0, math.radians(150.0)
"""No multirotor that carries a camera does more."""
_LONGEST_S = 0.5
"""After a longer gap nobody knows how it flew: no more is allowed for it."""


@dataclass(frozen=True, slots=True)
class Break:
    """Between two poses of the camera."""

    after_t_s: float
    """Of the last one on the path before; frames between the two have no place."""
    from_t_s: float
    why: str


@dataclass(frozen=True, slots=True)
class _Step:
    t_s: float
    position_m: F64
    heading_rad: float
    velocity_m_s: F64 | None


class PathWatch:
    """Poses in the order of their times; each is held against where the one before led to."""

    def __init__(self) -> None:
        self._last: _Step | None = None

    def clear(self) -> None:
        self._last = None

    def add(self, t_mono_s: float, position_m: F64, q_wxyz: F64) -> Break | None:
        last = self._last
        heading_rad = quaternions.heading(quaternions.rotation(q_wxyz / np.linalg.norm(q_wxyz)))
        if last is None or t_mono_s <= last.t_s:
            self._last = last or _Step(t_mono_s, position_m, heading_rad, None)
            return None
        dt_s = t_mono_s - last.t_s
        flown_m = position_m - last.position_m
        expected_m = np.zeros(3) if last.velocity_m_s is None else last.velocity_m_s * dt_s
        short_s = min(dt_s, _LONGEST_S)
        allowed_m = JUMP_M + 0.5 * ACCELERATION_M_S2 * short_s**2
        if last.velocity_m_s is None:
            allowed_m += ACCELERATION_M_S2 * short_s  # it may have been flying already
        away_m = float(np.linalg.norm(flown_m - expected_m))
        turn_rad = abs(math.remainder(heading_rad - last.heading_rad, math.tau))
        broken = away_m > allowed_m or turn_rad > JUMP_RAD + TURN_RAD_S * short_s
        # A jump is no velocity.
        self._last = _Step(t_mono_s, position_m, heading_rad, last.velocity_m_s if broken else flown_m / dt_s)
        if not broken:
            return None
        how = f"{away_m:.1f} m" if away_m > allowed_m else f"{math.degrees(turn_rad):.0f} degrees"
        return Break(last.t_s, t_mono_s, f"The camera's path jumped by {how}")
