"""What differs between the sensors: topics, frames, settings, how long frames wait."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace

from mapping.errors import CapacityError, MappingError
from mapping.perceiving import RadarPerception, RangePerception, Settings, VisionPerception
from mapping.perceiving.braking import Braking
from mapping.perceiving.settings_limits import check_settings
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import PerceptionSettings, Sensor

from mapping.braking import Braking
from mapping.perceiving import (
    CameraPose,
    Cloud,
    RadarPerception,
    RadarScan,
    RangePerception,
    RangeScan,
    Settings,
    VisionPerception,
)
from telemetry.messages import Topic
from telemetry.obstacles import PerceptionSettings, Sensor
from telemetry.sensing import CloudFrame, RadarFrame, RangeFrame, SlamPose, rows

AnyFrame = RadarFrame | CloudFrame | RangeFrame
AnyPerception = RadarPerception | VisionPerception | RangePerception

MOST_POINTS = 2_000_000
"""Of one frame; more than any sensor has."""


@dataclass(frozen=True, slots=True)
class SensorKind:
    """One sensor, as its node needs to know it."""

    sensor: Sensor
    frames: Topic
    maps: Topic
    status: Topic
    make: type[AnyPerception]
    scan: Callable[[Any], Any]
    """A frame as the perception takes it; ValueError when its arrays do not fit together."""
    settings: Callable[[PerceptionSettings], Settings]
    reach_m: float | None
    """What is seen out to there must fit into the map's memory at once; None: a frame is a handful of voxels."""
    backlog: int
    """Frames that wait at most; those before them are skipped."""
    looks: Topic | None = None
    """What the newest frame showed."""
    flight_maps: Topic | None = None
    """Where the map is local: of that of the whole flight."""

    @property
    def uses_camera(self) -> bool:
        return self.sensor == "vision"


def _radar_scan(frame: RadarFrame) -> RadarScan:
    xyz, speed, snr = rows(frame.xyz_m, 3), rows(frame.radial_speed_m_s, 1)[:, 0], rows(frame.snr_db, 1)[:, 0]
    if not len(xyz) == len(speed) == len(snr):
        raise ValueError(f"{len(xyz)} places, {len(speed)} speeds and {len(snr)} strengths")
    return RadarScan(frame.t_mono_s, frame.number, _few(xyz), speed, snr, frame.source)


def _cloud(frame: CloudFrame) -> Cloud:
    return Cloud(frame.t_mono_s, frame.number, _few(rows(frame.xyz_m, 3)), frame.source, frame.voxel_m)


def _range_scan(frame: RangeFrame) -> RangeScan:
    lists = (frame.bearing_rad, frame.elevation_rad, frame.range_m)
    bearing, elevation, range_m = (np.array(values, np.float64) for values in lists)
    if not len(bearing) == len(elevation) == len(range_m):
        raise ValueError(f"{len(bearing)} bearings, {len(elevation)} elevations and {len(range_m)} ranges")
    return RangeScan(
        frame.t_mono_s,
        frame.number,
        bearing,
        elevation,
        range_m,
        frame.source,
        np.array(frame.looks_rad, np.float64),
        frame.beam_rad,
        frame.nearest_m,
        frame.farthest_m,
    )


def _few(xyz: Any) -> Any:
    if len(xyz) > MOST_POINTS:
        raise ValueError(f"{len(xyz)} points")
    return xyz


def camera_pose(pose: SlamPose) -> CameraPose:
    return CameraPose(pose.t_mono_s, pose.position_m, pose.q_wxyz, pose.tracking)


def _settings(s: PerceptionSettings, depth_m: float, resolution_m: float) -> Settings:
    return Settings(
        depth_m=depth_m,
        fov_rad=math.radians(s.fov_deg),
        height_m=s.height_m,
        resolution_m=resolution_m,
        paper_bare=s.paper_bare,
        radar_variant=s.radar_variant,
        gate_azimuth_rad=math.radians(s.radar_azimuth_deg),
        gate_low_rad=math.radians(s.radar_low_deg),
        gate_high_rad=math.radians(s.radar_high_deg),
        vehicle_radius_m=s.vehicle_radius_m,
        position_error_m=s.position_error_m,
        braking=Braking(s.brake_decel_m_s2, s.brake_jerk_m_s3),
        memory_limit_bytes=s.memory_limit_bytes,
    )


RADAR = SensorKind(
    "radar",
    Topic.RADAR_FRAME,
    Topic.MAP_RADAR,
    Topic.PERCEPTION_RADAR,
    RadarPerception,
    _radar_scan,
    lambda s: _settings(s, s.radar_depth_m, s.radar_resolution_m),
    reach_m=None,
    backlog=20,  # Its map keeps everything, and a frame takes a millisecond: catching up is better than leaving out.
    looks=Topic.RADAR_LOOK,
)
VISION = SensorKind(
    "vision",
    Topic.CLOUD_FRAME,
    Topic.MAP_VISION,
    Topic.PERCEPTION_VISION,
    VisionPerception,
    _cloud,
    lambda s: replace(_settings(s, s.vision_depth_m, s.vision_resolution_m), cloud_voxel_m=s.cloud_voxel_m),
    reach_m=40.0,
    backlog=1,  # Its map is made of the newest frame alone.
    looks=Topic.CLOUD_LOOK,
    flight_maps=Topic.MAP_VISION_FLIGHT,
)
RANGES = SensorKind(
    "ranges",
    Topic.RANGE_FRAME,
    Topic.MAP_RANGES,
    Topic.PERCEPTION_RANGES,
    RangePerception,
    _range_scan,
    lambda s: _settings(s, s.ranges_depth_m, s.vision_resolution_m),
    reach_m=None,
    backlog=40,
)
KINDS: dict[str, SensorKind] = {kind.sensor: kind for kind in (RADAR, VISION, RANGES)}
