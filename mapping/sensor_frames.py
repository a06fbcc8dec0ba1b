"""What sensors put on the bus: radar frames, point clouds, the camera's own pose, ranges. Frozen dataclasses.

Body frame, as in the papers: x to the right, y forward, z up, metres, at the vehicle. Arrays travel as the bytes of
little-endian float32 in row order; ``rows`` reads and ``packed`` writes them. ``t_mono_s`` is when a frame was
MEASURED, on this machine's monotonic clock; who brings frames in from elsewhere converts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

F32 = NDArray[np.float32]

RadarKind = Literal["model", "iq"]
"""Of a simulated radar. model: targets, with errors drawn to the table of the real one's; iq: samples of its
converters, and the whole chain of processing."""


def packed(values: NDArray[np.floating]) -> bytes:
    """Any float array as little-endian float32, in row order."""
    return np.ascontiguousarray(values, dtype="<f4").tobytes()


def rows(data: bytes, columns: int) -> F32:
    """(N, columns) float32, read-only. Raises ValueError when the bytes are no whole rows."""
    return np.frombuffer(data, dtype="<f4").reshape(-1, columns)


@dataclass(frozen=True, slots=True)
class RadarFrame:
    """Targets of one radar frame. One without targets says that the radar works and sees nothing."""

    t_mono_s: float
    t_utc_s: float
    number: int
    """Counts up by one per frame of this source; gaps are lost frames."""
    source: str
    """"simulated", or the agent's name."""
    xyz_m: bytes
    """(N, 3) body frame"""
    radial_speed_m_s: bytes
    """(N,) positive: moving away"""
    snr_db: bytes
    """(N,)"""


@dataclass(frozen=True, slots=True)
class CloudFrame:
    """A point cloud of the stereo camera (or any range camera that looks forward)."""

    t_mono_s: float
    t_utc_s: float
    number: int
    source: str
    xyz_m: bytes
    """(N, 3) body frame"""
    voxel_m: float = 0.0
    """Edge of the voxels that it was thinned to on board; 0: not thinned."""


@dataclass(frozen=True, slots=True)
class SlamPose:
    """Where the camera's own SLAM believes to be, in a frame of its own: z up, its origin and heading arbitrary."""

    t_mono_s: float
    position_m: tuple[float, float, float]
    q_wxyz: tuple[float, float, float, float]
    """Unit quaternion, body frame -> SLAM frame."""
    tracking: Literal["good", "poor", "lost"] = "good"


@dataclass(frozen=True, slots=True)
class RangeFrame:
    """MAVLink OBSTACLE_DISTANCE or DISTANCE_SENSOR: ranges in single directions from the vehicle."""

    t_mono_s: float
    t_utc_s: float
    number: int
    source: str
    bearing_rad: tuple[float, ...]
    """Clockwise from the nose."""
    elevation_rad: tuple[float, ...]
    """Above the horizontal plane; -pi/2 is straight down."""
    range_m: tuple[float, ...]
    """Only those that hit something."""
    looks_rad: tuple[float, ...] = ()
    """Bearings of all level directions that were measured in, hit or not."""
    beam_rad: float = 0.0
    """Width of each."""
    nearest_m: float = 0.0
    farthest_m: float = 0.0
    """What is nearer or farther is not measured."""


@dataclass(frozen=True, slots=True)
class UwbScan:
    """What a UWB radar returned over range, looking level in one direction from the vehicle."""

    t_mono_s: float
    t_utc_s: float
    number: int
    """Counts up by one per scan of this source; gaps are lost scans."""
    source: str
    intensity: bytes
    """(bins,) in the radar's own counts"""
    bin_m: float = 0.30
    first_bin_m: float = 0.0
    """Range of the middle of the first bin."""
    beamwidth_rad: float = math.radians(40.0)
    """Of the whole beam."""
    bearing_rad: float = 0.0
    """Of the beam's axis, clockwise from the nose."""


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
