"""What differs between the sensors: topics, frames, settings, how long frames wait."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace

from mapping.errors import CapacityError, MappingError
from mapping.perceiving.braking import Braking
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.range_perception import RangePerception
from mapping.perceiving.settings_limits import check_settings
from mapping.perceiving.vision_perception import VisionPerception
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import PerceptionSettings, Sensor

AnyPerception = RadarPerception | VisionPerception | RangePerception


@dataclass(frozen=True, slots=True)
class SensorKind:
    """One sensor, as its node needs to know it."""

    sensor: Sensor
    frames: Topic
    maps: Topic
    status: Topic
    make: type[AnyPerception]
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
    lambda s: _settings(s, s.ranges_depth_m, s.vision_resolution_m),
    reach_m=None,
    backlog=40,
)
KINDS: dict[str, SensorKind] = {kind.sensor: kind for kind in (RADAR, VISION, RANGES)}


def check_perception(settings: PerceptionSettings) -> None:
    """Raises ParameterError or CapacityError, naming the sensor, the number and what to do."""
    for kind in KINDS.values():
        try:
            own = kind.settings(settings)
            check_settings(own, reach_m=kind.reach_m, reach_down=kind.make.reach_down(own))
        except MappingError as error:
            raise type(error)(error.what, where=f"{kind.sensor} map", advice=error.advice) from None
    settings.tracker.params()


def check_memory(limit_bytes: int, *, maps: int) -> None:
    """Raises CapacityError where so many maps of that size are more than this computer's memory."""
    here_bytes = computer_bytes()
    if maps * limit_bytes > here_bytes:
        each = "A map" if maps == 1 else f"{maps} maps"
        raise CapacityError(
            f"{each} of {limit_bytes / 1e6:,.0f} MB may need {maps * limit_bytes / 1e6:,.0f} MB; this computer has "
            f"{here_bytes / 1e6:,.0f} MB.",
            where="memory",
            advice=f"Allow at most {here_bytes // maps // 1_000_000:,} MB.",
        )


def computer_bytes() -> int:
    """Memory of this computer."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
