"""Climb until clear: straight up to the smallest height from which the region ahead is free (Bigazzi 2022, fig. 9)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planning.avoiding.model import AvoidanceParams, Manoeuvre, NoWay
from planning.avoiding.room import Room

F64 = NDArray[np.float64]


def way_up(
    position: F64, heading_rad: float, depth_m: float, room: Room, keep_m: float, params: AvoidanceParams
) -> Manoeuvre | NoWay:
    """``Manoeuvre`` or ``NoWay``; its points are the vehicle and the place above it."""
    ahead = depth_m * np.array([math.sin(heading_rad), math.cos(heading_rad), 0.0])
    for climb_m in np.arange(0.0, params.ceiling_m + 1e-9, params.step_m):
        top = position + np.array([0.0, 0.0, climb_m])
        region = np.vstack([position, top, top + ahead])
        if room.is_clear(region, keep_m):
            points = region[:2]
            return Manoeuvre(
                kind="over",
                points_enu_m=points,
                leg=0,
                height_offset_m=float(climb_m),
                seen_m=room.seen_m(region),
                surface_m=room.surface_m(region),
                length_m=float(climb_m),
                top_unseen=not room.with_open_tops().is_clear_of_seen(region, keep_m),
            )
    return NoWay("over", f"The region ahead is not clear up to {params.ceiling_m:g} m above the vehicle.")
