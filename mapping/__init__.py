"""Arrays in, arrays out: radar samples to targets, targets to tracks, points to maps, heights to traversability.

    import numpy as np
    from mapping import AWR1843, RadarChain, Tracker, VoxelMap

    found = RadarChain(AWR1843).process(cube)  # (chirps, antennas, samples) -> range, azimuth, elevation, radial speed
    polar = np.column_stack([found.range_m, found.azimuth_rad, found.radial_speed_m_s])
    still = np.zeros(2)
    objects = Tracker().step(0.0, polar, position_enu_m=still, velocity_enu_m_s=still, heading_rad=0.0)
    voxels = VoxelMap(resolution_m=0.5)
    voxels.insert(points_enu, origin_enu=(0.0, 0.0, 12.0), max_range_m=40.0)

The names in ``__all__`` are stable: what they take, return and raise changes only with the version's first number
(below 1.0 with its second), and CHANGELOG.md says so. All else in this package may move with any version.
Map frame: east, north, up; body frame: x right, y forward, z up; headings clockwise from north. SI units and radians;
degrees for latitude and longitude. Errors are ``MappingError``s: what is wrong, where, what to do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mapping.errors import MappingError
    from mapping.geometry.frames import LocalFrame, attitude_rotation
    from mapping.perceiving.roi import search_sector, sector_points
    from mapping.radar.chain import POSITION2GO_SETTINGS, ChainSettings, RadarChain
    from mapping.radar.detections import Detections
    from mapping.radar.radar_params import AWR1843, POSITION2GO, FmcwParams
    from mapping.tracking.tracker import Tracker
    from mapping.tracking.tracker_params import TrackerParams, TrackState
    from mapping.traversability import Traversability, traversability_map
    from mapping.uwb.clearing import UwbClearing, UwbPose
    from mapping.voxels.map import VoxelMap

__all__ = [
    "AWR1843",
    "POSITION2GO",
    "POSITION2GO_SETTINGS",
    "ChainSettings",
    "Detections",
    "FmcwParams",
    "LocalFrame",
    "MappingError",
    "RadarChain",
    "TrackState",
    "Tracker",
    "TrackerParams",
    "Traversability",
    "UwbClearing",
    "UwbPose",
    "VoxelMap",
    "attitude_rotation",
    "search_sector",
    "sector_points",
    "traversability_map",
]

_NAMES = {
    ".errors": ("MappingError",),
    ".geometry.frames": ("LocalFrame", "attitude_rotation"),
    ".perceiving.roi": ("search_sector", "sector_points"),
    ".radar.chain": ("POSITION2GO_SETTINGS", "ChainSettings", "RadarChain"),
    ".radar.detections": ("Detections",),
    ".radar.radar_params": ("AWR1843", "POSITION2GO", "FmcwParams"),
    ".tracking.tracker": ("Tracker",),
    ".tracking.tracker_params": ("TrackState", "TrackerParams"),
    ".traversability": ("Traversability", "traversability_map"),
    ".uwb.clearing": ("UwbClearing", "UwbPose"),
    ".voxels.map": ("VoxelMap",),
}


def lazily(package: str, names: Mapping[str, tuple[str, ...]]) -> Callable[[str], object]:
    """A package's ``__getattr__``: from its module when it is first asked for, so that one thing waits for no other."""

    def get(name: str) -> object:
        module = next((module for module, of_it in names.items() if name in of_it), None)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(module, package), name)

    return get


if not TYPE_CHECKING:
    __getattr__ = lazily(__name__, _NAMES)
