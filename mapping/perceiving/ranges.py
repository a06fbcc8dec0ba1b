"""Perception from single ranges: MAVLink's OBSTACLE_DISTANCE and DISTANCE_SENSOR."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.frames import heading_rotation
from mapping.perceiving.base import Perception
from mapping.perceiving.model import FrameResult, RangeScan

F64 = NDArray[np.float64]

NEAREST_M, FARTHEST_M = 0.1, 120.0


class RangePerception(Perception):
    """Global map of single ranges, at the vehicle's own position; without carving, as the radar's."""

    name = "ranges"

    def on_frame(self, scan: RangeScan, now_mono_s: float) -> FrameResult:
        """Take one scan; never raises for what is in it."""
        pose = self._pose_for(scan, now_mono_s)
        if isinstance(pose, FrameResult):
            return pose
        points = self._points(scan) @ heading_rotation(pose.heading_rad).T + pose.position_enu_m
        ground = self._known_ground
        explained = None if ground is None else ground.explains_points(points, self._within_m)
        self.map.insert_hits(points, explained=explained)
        return self._look(scan.t_mono_s, now_mono_s, pose, len(points))

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
