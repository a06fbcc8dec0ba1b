"""Perception without sockets or clocks: sensor frames and poses in, map, regions, obstacles and alerts out."""

from mapping.perceiving.model import (
    CameraPose,
    Cloud,
    FrameResult,
    RadarScan,
    RangeScan,
    SearchedRegion,
    Settings,
)
from mapping.perceiving.radar import RadarPerception
from mapping.perceiving.ranges import RangePerception
from mapping.perceiving.vision import VisionPerception

__all__ = [
    "CameraPose",
    "Cloud",
    "FrameResult",
    "RadarPerception",
    "RadarScan",
    "RangePerception",
    "RangeScan",
    "SearchedRegion",
    "Settings",
    "VisionPerception",
]
