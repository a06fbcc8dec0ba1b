"""Whether a sensor's settings fit this computer: its map into memory, its region and corridor between two frames."""

from __future__ import annotations

import math

from mapping.errors import CapacityError
from mapping.perceiving.base import LONGEST_CORRIDOR_M, ROI_STEP_M
from mapping.perceiving.model import Settings
from mapping.roi import MOST_POINTS, checked_sector
from mapping.voxels.checks import checked_size


def check_settings(settings: Settings, *, reach_m: float | None, reach_down: float) -> None:
    """Raises ParameterError or CapacityError, with the number that is too large and the one that would do.

    ``reach_m``: see ``checked_size``; ``reach_down``: see ``tube_points``.
    """
    s = settings
    checked_size(s.resolution_m, reach_m, s.memory_limit_bytes)
    checked_sector(
        depth_m=s.depth_m, fov_rad=s.fov_rad, height_m=s.height_m, resolution_m=min(ROI_STEP_M, s.resolution_m)
    )
    _check_corridor(s.vehicle_radius_m + s.position_error_m, s.resolution_m, reach_down)


def _check_corridor(radius_m: float, resolution_m: float, reach_down: float) -> None:
    count = corridor_points(radius_m, resolution_m, reach_down)
    if count <= MOST_POINTS:
        return
    finest_m = resolution_m
    while corridor_points(radius_m, finest_m, reach_down) > MOST_POINTS:
        finest_m *= 1.02
    raise CapacityError(
        f"A corridor {LONGEST_CORRIDOR_M:g} m long and {2 * radius_m:g} m wide at {resolution_m:g} m has about "
        f"{count:,} points; {MOST_POINTS:,} are the most.",
        where="resolution_m",
        advice=f"Choose {math.ceil(finest_m * 100) / 100:g} m or coarser, or a smaller radius and position error.",
    )


def corridor_points(radius_m: float, resolution_m: float, reach_down: float) -> int:
    """About as many as ``tube_points`` makes of the longest corridor, without making one."""
    step_m = resolution_m / 2
    along = math.ceil(LONGEST_CORRIDOR_M / step_m) + 1
    across = 2 * max(1, math.ceil(radius_m / step_m)) + 1
    layers = reach_down * LONGEST_CORRIDOR_M / step_m
    return round(along * (math.pi / 6 * across**3 + layers / 2 * math.pi / 4 * across**2))
