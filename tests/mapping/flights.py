"""Small flights and radars for tests of perception: straight, level, without a simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.frames import attitude_rotation
from mapping.perceiving.frame_result import FrameResult
from mapping.perceiving.ground import GroundGrid, ground_grid
from mapping.perceiving.perception import Perception
from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.vision_perception import VisionPerception
from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose, packed

DOWN_5_M = 5.0


def radar_frame(t_s: float, number: int, xyz_m: ArrayLike, speed_m_s: ArrayLike, snr: ArrayLike) -> RadarFrame:
    return RadarFrame.of(xyz_m, speed_m_s, snr, t_mono_s=t_s, t_utc_s=0.0, number=number, source="")


def flat_ground(up_m: float = -DOWN_5_M) -> GroundGrid:
    """400 m x 400 m around the origin, 1 m cells."""
    return ground_grid(np.full((400, 400), up_m, np.float32), [[0.0, -1.0, 200.0], [1.0, 0.0, 200.0]])


@dataclass
class Flight:
    """Northwards at a constant speed and height; feeds poses, counts frames."""

    perception: Perception
    speed_m_s: float = 4.0
    t_s: float = 100.0
    number: int = 0
    north_m: float = 0.0
    east_m: float = 0.0
    up_m: float = 0.0
    pitch_rad: float = 0.0
    heading_rad: float = 0.0
    results: list[FrameResult] = field(default_factory=list)

    def move(self, dt_s: float = 0.1, *, has_fix: bool = True) -> None:
        self.t_s += dt_s
        self.north_m += self.speed_m_s * dt_s
        self.perception.feed_position(self.t_s, self.position, (0.0, self.speed_m_s, 0.0), has_fix=has_fix)
        self.perception.feed_attitude(self.t_s, 0.0, self.pitch_rad, self.heading_rad)

    @property
    def position(self) -> np.ndarray:
        return np.array([self.east_m, self.north_m, self.up_m])

    def body(self, points_enu: np.ndarray) -> np.ndarray:
        return (points_enu - self.position) @ attitude_rotation(self.heading_rad, self.pitch_rad, 0.0)

    def radar(self, points_enu: np.ndarray, snr_db: np.ndarray | float = 40.0) -> FrameResult:
        """A frame in which these fixed things are seen without error."""
        assert isinstance(self.perception, RadarPerception)
        xyz = self.body(np.asarray(points_enu, np.float64).reshape(-1, 3))
        speed = -self.speed_m_s * xyz[:, 1] / np.maximum(np.linalg.norm(xyz, axis=1), 1e-9)
        self.number += 1
        frame = radar_frame(self.t_s, self.number, xyz, speed, np.broadcast_to(snr_db, len(xyz)))
        self.results.append(self.perception.on_frame(frame, self.t_s + 0.02))
        return self.results[-1]

    def camera(self, points_enu: np.ndarray, *, voxel_m: float = 0.1, slam: SlamPose | None = None) -> FrameResult:
        """A cloud of these points, and where SLAM believes to be (right, in the map's frame, unless given)."""
        assert isinstance(self.perception, VisionPerception)
        half = self.heading_rad / 2
        true = SlamPose(self.t_s, tuple(self.position.tolist()), (math.cos(half), 0.0, 0.0, -math.sin(half)))
        self.perception.feed_camera(slam or true)
        xyz = self.body(np.asarray(points_enu, np.float64).reshape(-1, 3))
        self.number += 1
        cloud = CloudFrame(self.t_s, 0.0, self.number, "", packed(xyz), voxel_m)
        self.results.append(self.perception.on_frame(cloud, self.t_s + 0.05))
        return self.results[-1]

    def begun(self) -> list[str]:
        """Kinds of the alerts that have begun."""
        return [e.kind for result in self.results for e in result.alerts if e.phase == "begins"]


def snr_db(cross_section_m2: float, range_m: float) -> float:
    """What the AWR1843 makes of it straight ahead."""
    return 17.8 + 10 * math.log10(cross_section_m2) - 40 * math.log10(range_m / 120.0)
