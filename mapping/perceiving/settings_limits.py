"""Whether a sensor's settings fit this computer: its map into memory, its region and corridor between two frames."""

from __future__ import annotations

import math

from mapping.errors import CapacityError, ParameterError
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.perception import LONGEST_CORRIDOR_M, ROI_STEP_M
from mapping.perceiving.roi import MOST_POINTS, checked_sector
from mapping.voxels.checks import checked_size

COARSEST_CLOUD = 0.5
"""Of a voxel's edge: what is thinned more coarsely leaves voxels empty in which something was seen."""
LEAST_GATE_DEG = 5.0
"""Elevations are measured to 7 degrees."""


def check_settings(settings: Settings, *, reach_m: float | None, reach_down: float) -> None:
    """Raises ParameterError or CapacityError, with the number that is too large and the one that would do.

    ``reach_m``: see ``checked_size``; ``reach_down``: see ``tube_points``.
    """
    s = settings
    check_gate(s)
    check_thinning(s)
    checked_size(s.resolution_m, reach_m, s.memory_limit_bytes)
    checked_sector(
        depth_m=s.depth_m, fov_rad=s.fov_rad, height_m=s.height_m, resolution_m=min(ROI_STEP_M, s.resolution_m)
    )
    _check_corridor(s.vehicle_radius_m + s.position_error_m, s.resolution_m, reach_down)


def check_thinning(s: Settings) -> None:
    """Raises ParameterError."""
    coarsest_m = COARSEST_CLOUD * s.resolution_m
    if not 0.0 <= s.cloud_voxel_m <= coarsest_m:
        raise ParameterError(
            f"Clouds thinned to one point per {s.cloud_voxel_m:g} m leave gaps in a map of {s.resolution_m:g} m.",
            where="cloud_voxel_m",
            advice=f"Give 0 (all points) to {coarsest_m:g} m, half a voxel of the camera's map.",
        )


def check_gate(s: Settings) -> None:
    """Raises ParameterError."""
    low_deg, high_deg = math.degrees(s.gate_low_rad), math.degrees(s.gate_high_rad)
    if not (-80.0 <= low_deg <= 0.0 and LEAST_GATE_DEG - 1e-9 <= high_deg <= 80.0):
        raise ParameterError(
            f"Through a gate from {low_deg:g} to {high_deg:g} degrees of elevation the radar does not see what stands "
            "at the vehicle's height.",
            where="gate",
            advice=f"Begin it at 0 degrees or lower, and end it at {LEAST_GATE_DEG:g} or higher (usually 0 to 20).",
        )
    if not 0.0 < s.gate_azimuth_rad <= math.pi / 2:
        raise ParameterError(
            f"The radar's gate is {math.degrees(s.gate_azimuth_rad):g} degrees wide to either side.",
            where="gate",
            advice="Give more than 0 and at most 90 degrees (usually 45).",
        )


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
