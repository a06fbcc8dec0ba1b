"""What sensors measure, as it travels: radar frames, point clouds, the camera's own pose, ranges, UWB scans.

Body frame, as in the papers: x to the right, y forward, z up, metres, at the vehicle. Arrays are kept as the bytes of
little-endian float32 in row order, on the bus, in recordings and here; ``rows`` reads and ``packed`` writes them.
``t_mono_s`` is when a frame was MEASURED, on this machine's monotonic clock; who brings frames in from elsewhere
converts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F32

MOST_POINTS = 2_000_000
"""Of one frame; more than any sensor has."""
_XYZ_BYTES, _NUMBER_BYTES = 12, 4
_REACH = 1 << 20
"""Voxels to each side of the origin that a thinned cloud's keys can tell apart."""


def packed(values: ArrayLike) -> bytes:
    """Any float array as little-endian float32, in row order; what that cannot hold becomes infinite."""
    with np.errstate(over="ignore"):
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

    @classmethod
    def of(
        cls,
        xyz_m: ArrayLike,
        radial_speed_m_s: ArrayLike,
        snr_db: ArrayLike,
        *,
        t_mono_s: float,
        t_utc_s: float,
        number: int,
        source: str,
    ) -> RadarFrame:
        """Of targets as arrays."""
        columns = (packed(xyz_m), packed(radial_speed_m_s), packed(snr_db))
        return cls(t_mono_s, t_utc_s, number, source, *columns)

    @property
    def is_whole(self) -> bool:
        """Its columns are of one length; otherwise nothing of it can be read."""
        count, rest = divmod(len(self.xyz_m), _XYZ_BYTES)
        numbers = (len(self.radial_speed_m_s), len(self.snr_db))
        return not rest and count <= MOST_POINTS and numbers == (count * _NUMBER_BYTES,) * 2

    def columns(self) -> tuple[F32, F32, F32]:
        """(N, 3) places, (N,) radial speeds and (N,) strengths, of a whole frame."""
        return rows(self.xyz_m, 3), rows(self.radial_speed_m_s, 1)[:, 0], rows(self.snr_db, 1)[:, 0]


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

    @property
    def is_whole(self) -> bool:
        count, rest = divmod(len(self.xyz_m), _XYZ_BYTES)
        return not rest and count <= MOST_POINTS

    @property
    def points_m(self) -> F32:
        """(N, 3) of a whole frame."""
        return rows(self.xyz_m, 3)


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

    @property
    def is_whole(self) -> bool:
        return len(self.bearing_rad) == len(self.elevation_rad) == len(self.range_m)


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


SensorFrame = RadarFrame | CloudFrame | RangeFrame
"""What goes into a map."""


def thinned(xyz_m: F32, voxel_m: float) -> F32:
    """One of the finite points (N, 3) in each voxel, the first. 0: all stay."""
    if voxel_m <= 0.0 or not len(xyz_m):
        return xyz_m
    cells = np.clip(np.floor(xyz_m / np.float32(voxel_m)), -_REACH, _REACH - 1).astype(np.int64) + _REACH
    keys = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    _, first = np.unique(keys, return_index=True)
    return xyz_m[np.sort(first)]
