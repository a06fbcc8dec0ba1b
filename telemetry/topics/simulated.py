"""What a simulated vehicle and its sensors say of themselves: for simulated sensors and for tests, for nobody else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

RadarKind = Literal["model", "iq"]
"""Of a simulated radar. model: targets, with errors drawn to the table of the real one's; iq: samples of its
converters, and the whole chain of processing."""


@dataclass(frozen=True, slots=True)
class SimTruth:
    """Where the simulated vehicle really is: for simulated sensors and for tests, for nobody else."""

    t_mono_s: float
    t_utc_s: float
    t_sim_s: float
    home_lat_deg: float
    home_lon_deg: float
    home_alt_amsl_m: float
    position_enu_m: tuple[float, float, float]
    """From the simulation's origin, z = 0 on the ground there."""
    velocity_enu_m_s: tuple[float, float, float]
    roll_rad: float
    pitch_rad: float
    heading_rad: float
    armed: bool
