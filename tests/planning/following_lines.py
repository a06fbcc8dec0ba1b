"""Reference lines and flights over them that the tests of following share."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import along_m
from planning.following.reference import Reference


def line(points: object, *, speed_m_s: float = 2.0, hold_s: float = 0.0, takeoff_s: float = 5.0) -> Reference:
    """A reference over points (K, 3), passed at a steady speed, holding at every inner one."""
    points_m = np.array(points, dtype=np.float64)
    s_m = along_m(points_m[:, :2])
    flown_s = takeoff_s + s_m / speed_m_s
    holds_s = hold_s * np.clip(np.arange(len(points_m)), 0, len(points_m) - 2)
    arrive_s = flown_s + np.concatenate([[0.0], holds_s[:-1]])
    leave_s = flown_s + holds_s
    x, y, z = points_m[0]
    return Reference(
        points_m=points_m,
        s_m=s_m,
        leg_item=np.arange(1, len(points_m), dtype=np.int64),
        arrive_s=arrive_s,
        leave_s=leave_s,
        takeoff_s=takeoff_s,
        flight_s=float(leave_s[-1] - takeoff_s),
        total_s=float(leave_s[-1]) + 20.0,
        home_xy_m=(float(x), float(y)),
        home_alt_dsm_m=0.0,
        first_item=0,
        last_item=len(points_m) - 1,
        first_m=(float(x), float(y), float(z)),
    )


def flown(reference: Reference, *, speed_m_s: float = 2.0, rate_hz: float = 10.0) -> tuple[F64, F64]:
    """(N,) seconds and (N, 3) positions of a flight exactly along a reference's line."""
    t_s = np.arange(0.0, reference.length_m / speed_m_s + 1 / rate_hz, 1 / rate_hz)
    s_m = np.minimum(t_s * speed_m_s, reference.length_m)
    return t_s, np.column_stack([np.interp(s_m, reference.s_m, column) for column in reference.points_m.T])
