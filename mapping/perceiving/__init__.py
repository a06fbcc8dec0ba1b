"""Perception without sockets or clocks: sensor frames and poses in, map, regions, obstacles and alerts out."""

from mapping.perceiving.frame_result import FrameResult, SearchedRegion, Settings
from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.range_perception import RangePerception
from mapping.perceiving.vision_perception import VisionPerception

__all__ = [
    "FrameResult",
    "RadarPerception",
    "RangePerception",
    "SearchedRegion",
    "Settings",
    "VisionPerception",
]
