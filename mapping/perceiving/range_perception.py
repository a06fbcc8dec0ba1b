"""Perception from single ranges: MAVLink's OBSTACLE_DISTANCE and DISTANCE_SENSOR."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mapping.frames import heading_rotation
from mapping.perceiving.base import Perception
from mapping.perceiving.model import FrameResult, RangeScan, SearchedRegion, Settings
from mapping.poses import Pose

F64 = NDArray[np.float64]

NEAREST_M, FARTHEST_M = 0.1, 120.0


class RangePerception(Perception):
    """Global map of single ranges, at the vehicle's own position; without carving, as the radar's."""

    name = "ranges"

    def __init__(self, settings: Settings, *, alert_prefix: str = "") -> None:
        super().__init__(settings, alert_prefix=alert_prefix)
        self._scan: RangeScan | None = None

    def on_frame(self, scan: RangeScan, now_mono_s: float) -> FrameResult:
        """Take one scan; never raises for what is in it."""
        pose = self._pose_for(scan, now_mono_s)
        if isinstance(pose, FrameResult):
            return pose
        self._scan = scan
        points = self._points(scan) @ heading_rotation(pose.heading_rad).T + pose.position_enu_m
        ground = self._known_ground
        explained = None if ground is None else ground.explains_points(points, self._within_m)
        self.map.insert_hits(points, explained=explained)
        return self._look(scan.t_mono_s, now_mono_s, pose, len(points))

    @property
    def _looks_ahead(self) -> bool:
        """A sensor that looks down, or aside, sees nothing of the way."""
        scan = self._scan
        if scan is None or not len(scan.looks_rad):
            return False
        off_rad = np.abs(np.remainder(scan.looks_rad + np.pi, 2 * np.pi) - np.pi)
        return bool(off_rad.min() <= (scan.beam_rad + self.settings.fov_rad) / 2)

    @property
    def _depth_m(self) -> float:
        """No farther than it measures."""
        return min(self.settings.depth_m, self._scan.farthest_m if self._scan is not None else np.inf)

    def _sees(self, range_m: F64, aside_rad: F64) -> NDArray[np.bool_]:
        """In one of the directions that were measured in."""
        scan = self._scan
        if scan is None or not len(scan.looks_rad):
            return np.zeros(len(range_m), np.bool_)
        off_rad = np.abs(np.remainder(aside_rad[:, None] - scan.looks_rad + np.pi, 2 * np.pi) - np.pi).min(axis=1)
        return (off_rad <= scan.beam_rad / 2) & (range_m >= scan.nearest_m) & (range_m <= scan.farthest_m)

    def _region(self, pose: Pose, occupied: bool, hidden_m: float | None) -> SearchedRegion | None:
        region = super()._region(pose, occupied, hidden_m)
        if region is None or self._scan is None or not self._looks_ahead:
            return None
        return replace(region, nearest_m=self._scan.nearest_m)

    def _points(self, scan: RangeScan) -> F64:
        """(N, 3) of the believable ranges, levelled: directions count from the horizontal plane."""
        bearing, elevation, range_m = (
            np.asarray(a, np.float64).ravel() for a in (scan.bearing_rad, scan.elevation_rad, scan.range_m)
        )
        finite = np.isfinite(bearing) & np.isfinite(elevation) & np.isfinite(range_m)
        good = finite & (range_m >= NEAREST_M) & (range_m <= FARTHEST_M)
        self._count("points: not finite", int((~finite).sum()))
        self._count("points: absurd range", int((finite & ~good).sum()))
        b, e, r = bearing[good], elevation[good], range_m[good]
        return np.column_stack([r * np.cos(e) * np.sin(b), r * np.cos(e) * np.cos(b), r * np.sin(e)])
