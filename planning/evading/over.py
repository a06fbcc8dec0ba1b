"""Over: along the mission's line, raised by as little as is enough."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import length_m
from planning.evading.keep_clear import Room
from planning.evading.line import LineAhead
from planning.evading.model import AvoidanceParams, Manoeuvre, NoWay


def way_over(
    position: F64, line: LineAhead, blocked: tuple[float, float], room: Room, keep_m: float, params: AvoidanceParams
) -> Manoeuvre | NoWay:
    """``Manoeuvre`` or ``NoWay``. What was not seen above the highest voxel is not known to be free."""
    end_m = min(line.length_m, blocked[1] + params.keep_m + params.step_m)
    least_m = max(0.0, float(position[2] - line.at(0.0)[2]))
    for offset_m in np.arange(least_m, params.ceiling_m + 1e-9, params.step_m):
        if room.is_clear(_raised(position, line, line.length_m, offset_m), keep_m):
            points = _raised(position, line, end_m, offset_m)
            return Manoeuvre(
                kind="over",
                points_enu_m=points,
                leg=line.leg_at(end_m),
                height_offset_m=float(offset_m),
                seen_m=room.seen_m(points),
                surface_m=room.surface_m(points),
                length_m=length_m(points),
                top_unseen=not room.with_open_tops().is_clear_of_seen(points, keep_m),
            )
    return NoWay("over", f"It is not clear up to {params.ceiling_m:g} m above the plan.")


def _raised(position: F64, line: LineAhead, to_m: float, offset_m: float) -> F64:
    above = line.between(0.0, to_m) + np.array([0.0, 0.0, offset_m])
    top = np.array([position[0], position[1], max(position[2], above[0, 2])])
    return np.vstack([position, top, above[1:]])  # Miccinesi 2022, fig. 9
