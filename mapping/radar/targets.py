"""Radar targets: which are kept, and where in the map they are put (Miccinesi 2022, section 2.2 and fig. 15)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.frames import heading_rotation

Variant = Literal["heading_only", "full_attitude", "full_attitude_flat"]
"""Fig. 13 (chosen there, our default), fig. 15a and fig. 15b."""


@dataclass(frozen=True, slots=True)
class Gate:
    """Where a target must be measured to be kept, in the radar's own frame."""

    azimuth_rad: float = math.radians(45)
    """To both sides."""
    elevation_low_rad: float = 0.0
    elevation_high_rad: float = math.radians(20)
    nearest_m: float = 1.5
    """Nearer there are the vehicle's own arms, and the ground that it stands on."""
    farthest_m: float = 125.0
    """The radar's 120 m and its noise: farther is absurd."""


@dataclass(frozen=True, slots=True)
class Polar:
    """Targets as the radar measured them, in its frame."""

    range_m: F64
    azimuth_rad: F64
    """Clockwise from the nose."""
    elevation_rad: F64


def polar(xyz_m: NDArray[np.floating]) -> Polar:
    """(N, 3) body metres, x right, y forward, z up."""
    x, y, z = np.asarray(xyz_m, np.float64).reshape(-1, 3).T
    return Polar(np.sqrt(x * x + y * y + z * z), np.arctan2(x, y), np.arctan2(z, np.hypot(x, y)))


def in_gate(targets: Polar, gate: Gate) -> Bools:
    """(N,) Which targets are kept: +-45 degrees of azimuth, 0 to 20 degrees of elevation, a believable range."""
    return (
        (np.abs(targets.azimuth_rad) <= gate.azimuth_rad)
        & (targets.elevation_rad >= gate.elevation_low_rad)
        & (targets.elevation_rad <= gate.elevation_high_rad)
        & (targets.range_m >= gate.nearest_m)
        & (targets.range_m <= gate.farthest_m)
    )


def to_enu(
    xyz_m: NDArray[np.floating], position_enu_m: F64, R_enu_body: F64, heading_rad: float, variant: Variant
) -> F64:
    """(N, 3) body metres -> (N, 3) map metres.

    heading_only: z set to zero, turned by the heading alone (eqs 4-5): at the vehicle's own height.
    full_attitude: turned by the whole attitude, measured elevation and all (fig. 15a).
    full_attitude_flat: z set to zero, turned by the whole attitude (fig. 15b).
    x and y stay as measured (eq. 6): a thing stands no farther away than the radar has it, 6 % nearer than its slant
    range at the gate's upper edge.
    """
    p_body = np.asarray(xyz_m, np.float64).reshape(-1, 3)
    if variant == "full_attitude":
        return p_body @ R_enu_body.T + position_enu_m  # Miccinesi 2022, fig. 15
    R = heading_rotation(heading_rad) if variant == "heading_only" else R_enu_body
    return p_body * (1.0, 1.0, 0.0) @ R.T + position_enu_m  # Miccinesi 2022, eq. 5, eq. 6
