"""Perception from single ranges: MAVLink's OBSTACLE_DISTANCE and DISTANCE_SENSOR."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.frames import heading_rotation
from mapping.geometry.poses import Pose
from mapping.perceiving.frame_result import FrameResult, SearchedRegion, Settings
from mapping.perceiving.perception import Perception
from mapping.sensor_frames import RangeFrame

NEAREST_M, FARTHEST_M = 0.1, 120.0


class RangePerception(Perception):
    """Global map of single ranges, at the vehicle's own position; without carving, as the radar's."""

    name = "ranges"

    def __init__(self, settings: Settings, *, alert_prefix: str = "") -> None:
        super().__init__(settings, alert_prefix=alert_prefix)
        self._frame: RangeFrame | None = None

    def on_frame(self, frame: RangeFrame, now_mono_s: float) -> FrameResult:
        """Take one frame; never raises for what is in it."""
        pose = self._pose_for(frame, now_mono_s)
        if isinstance(pose, FrameResult):
            return pose
        self._frame = frame
        points = self._points(frame) @ heading_rotation(pose.heading_rad).T + pose.position_enu_m
        ground = self._known_ground
        explained = None if ground is None else ground.explains_points(points, self._within_m)
        self.map.insert_hits(points, explained=explained)
        return self._look(frame.t_mono_s, now_mono_s, pose, len(points))

    @property
    def _looks_ahead(self) -> bool:
        """A sensor that looks down, or aside, sees nothing of the way."""
        frame = self._frame
        if frame is None or not len(frame.looks_rad):
            return False
        off_rad = np.abs(np.remainder(np.array(frame.looks_rad) + np.pi, 2 * np.pi) - np.pi)
        return bool(off_rad.min() <= (frame.beam_rad + self.settings.fov_rad) / 2)

    @property
    def _depth_m(self) -> float:
        """No farther than it measures."""
        return min(self.settings.depth_m, self._frame.farthest_m if self._frame is not None else np.inf)

    def _sees(self, range_m: F64, aside_rad: F64) -> Bools:
        """In one of the directions that were measured in."""
        frame = self._frame
        if frame is None or not len(frame.looks_rad):
            return np.zeros(len(range_m), np.bool_)
        off_rad = aside_rad[:, None] - np.array(frame.looks_rad)
        off_rad = np.abs(np.remainder(off_rad + np.pi, 2 * np.pi) - np.pi).min(axis=1)
        return (off_rad <= frame.beam_rad / 2) & (range_m >= frame.nearest_m) & (range_m <= frame.farthest_m)

    def _region(self, pose: Pose, occupied: bool, hidden_m: float | None) -> SearchedRegion | None:
        region = super()._region(pose, occupied, hidden_m)
        if region is None or self._frame is None or not self._looks_ahead:
            return None
        return replace(region, nearest_m=self._frame.nearest_m)

    def _points(self, frame: RangeFrame) -> F64:
        """(N, 3) of the believable ranges, levelled: directions count from the horizontal plane."""
        bearing, elevation, range_m = (
            np.array(a, np.float64) for a in (frame.bearing_rad, frame.elevation_rad, frame.range_m)
        )
        finite = np.isfinite(bearing) & np.isfinite(elevation) & np.isfinite(range_m)
        good = finite & (range_m >= NEAREST_M) & (range_m <= FARTHEST_M)
        self._count("points: not finite", int((~finite).sum()))
        self._count("points: absurd range", int((finite & ~good).sum()))
        b, e, r = bearing[good], elevation[good], range_m[good]
        return np.column_stack([r * np.cos(e) * np.sin(b), r * np.cos(e) * np.cos(b), r * np.sin(e)])
