"""Perception from the stereo camera: a local map, made anew from every cloud where the camera's own SLAM says it is.

Beside it a map of the whole flight, for looking at: nothing is searched in it.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from mapping.geometry import quaternions
from mapping.geometry.arrays import F32, F64, Bools
from mapping.geometry.poses import Pose, PoseTrack
from mapping.perceiving.camera_path import Break, PathWatch
from mapping.perceiving.flight_map import FlightMap
from mapping.perceiving.frame_result import FrameResult, Settings, State
from mapping.perceiving.perception import Perception
from mapping.sensor_frames import CloudFrame, SlamPose, thinned

NEAREST_M, FARTHEST_M = 0.3, 40.0
"""Bigazzi 2022: vision reaches 40 m."""
BLIND_POINTS = 20
"""A cloud of fewer points shows nothing."""
FEWEST_POINTS = 2
"""In a voxel, for it to be occupied, unless the cloud was thinned: a single stereo match is often wrong."""
DEPTH_SIGMA_PER_M2 = 0.002
"""Stereo: the depth's standard deviation grows with the square of the distance."""
SIGMAS = 3.0
DIVERGED_M, DIVERGED_SHARE = 3.0, 0.02
"""The two paths have parted beyond what SLAM's drift, a share of the distance flown, explains."""
CLOSER_AGAIN = 0.8
OFFSET_SMOOTHING_S = 0.5
MOST_BREAKS = 20
"""Of the camera's path, ahead of its clouds."""


@dataclass(frozen=True, slots=True)
class SeenCloud:
    """The believable points of one cloud, in the map's frame."""

    t_mono_s: float
    points_m: F64
    """(N, 3)"""
    eye_m: F64
    """(3,) from where they were seen"""


class VisionPerception(Perception):
    """The camera's map. Its path is laid over the vehicle's own positions once; from then on SLAM alone positions it.

    Until there is such a position the map stands in SLAM's own frame (Bigazzi 2022: vision needs no geolocation),
    turned by the compass where the vehicle tells its heading. Region and alerts are as good there; neither known ground
    nor the mission can be laid under it. When the first position comes, what is known moves with the frame.

    How far the two paths have parted since is measured, and told when it is more than drift. Known ground and the
    mission are given in the vehicle's own positions: they are laid under this map by the measured difference, which
    stays as it is while there is no GNSS.
    """

    name = "vision"

    def __init__(self, settings: Settings, *, alert_prefix: str = "") -> None:
        super().__init__(settings, alert_prefix=alert_prefix)
        self._flight = FlightMap(settings)
        self.newest: SeenCloud | None = None
        self._path = PathWatch()
        self._breaks: deque[Break] = deque(maxlen=MOST_BREAKS)
        self._camera = PoseTrack()
        self._tracking: str = "good"
        self._aligned: tuple[F64, F64] | None = None
        self._placed = False
        self._points = -1
        self._offset_t_s = -math.inf
        self._flown_m = 0.0
        self._last: Pose | None = None
        self._diverged = False
        self.divergence_m: float | None = None

    def feed_camera(self, pose: SlamPose) -> None:
        """Where SLAM believes to be. A lost path is laid over GNSS again when it is back."""
        self._tracking = pose.tracking
        if pose.tracking == "lost":
            self._camera.clear()
            self._path.clear()
            self._breaks.clear()
            self._aligned = None
            return
        believed = True
        for refused in (
            self._camera.add_position(pose.t_mono_s, pose.position_m),
            self._camera.add_attitude(pose.t_mono_s, pose.q_wxyz),
        ):
            if refused is not None:
                believed = False
                self.dropped[f"camera pose: {refused}"] += 1
        if believed and (found := self._path.add(pose.t_mono_s, np.array(pose.position_m), np.array(pose.q_wxyz))):
            self._breaks.append(found)

    def set_settings(self, settings: Settings) -> None:
        is_another = self.settings.makes_another_map(settings)
        super().set_settings(settings)
        if is_another:
            self._flight = FlightMap(settings)

    @property
    def flight(self) -> FlightMap:
        return self._flight

    def accumulate(self) -> None:
        """The last frame into the map of the whole flight."""
        self._flight.put_in()

    def _forget(self) -> None:
        super()._forget()
        self._flight.clear()

    def on_frame(self, cloud: CloudFrame, now_mono_s: float) -> FrameResult:
        """Take one cloud; never raises for what is in it."""
        refusal = self._refusal(cloud, now_mono_s)
        if refusal is not None:
            return self._drop(cloud, refusal, now_mono_s)
        pose = self._pose(cloud.t_mono_s)
        if isinstance(pose, str):
            return self._drop(cloud, pose, now_mono_s)
        points = self._points_enu(cloud, pose)
        self.map.clear()
        self._insert(points, pose, singly=cloud.voxel_m > 0 or self.settings.cloud_voxel_m > 0)
        self._points = len(points)
        self.newest = SeenCloud(cloud.t_mono_s, points, pose.position_enu_m)
        return self._with_divergence(self._look(cloud.t_mono_s, now_mono_s, pose, len(points)))

    def _pose(self, t_mono_s: float) -> Pose | str:
        """In the map's frame, from SLAM."""
        if self._tracking == "lost":
            return "the camera lost its way"
        seen = self._camera.at(t_mono_s)
        if isinstance(seen, str):
            return f"camera: {seen}"
        own = self.track.at(t_mono_s) if self._has_fix else "no GNSS position"
        if self._aligned is None:
            self._flight.begin_part("The camera had lost its way", t_mono_s)
            if self._placed and isinstance(own, Pose):
                self._aligned = self._align(seen, own)
            elif self._last is not None:
                self._aligned = self._align(seen, self._last)
            else:
                self._aligned = self._turned_by_compass(seen)
        if not self._placed and isinstance(own, Pose):
            self._place(self._aligned, self._align(seen, own))
        q_map_slam, shift = self._aligned
        R = quaternions.rotation(q_map_slam)
        velocity = own.velocity_enu_m_s if isinstance(own, Pose) else R @ seen.velocity_enu_m_s
        q = quaternions.product(q_map_slam, seen.q_enu_body)
        pose = Pose(t_mono_s, R @ seen.position_enu_m + shift, velocity, q)
        self._measure(pose, own)
        return pose

    @property
    def placed(self) -> bool:
        return self._placed

    def _turned_by_compass(self, seen: Pose) -> tuple[F64, F64]:
        """SLAM's own frame, its north where the vehicle's compass has it; as it is without one."""
        heading_rad = self.track.heading_at(seen.t_mono_s)
        turn = 0.0 if heading_rad is None else heading_rad - seen.heading_rad
        return quaternions.from_attitude(turn, 0.0, 0.0), np.zeros(3)

    def _place(self, before: tuple[F64, F64], aligned: tuple[F64, F64]) -> None:
        """The first position: what was found in SLAM's own frame goes where it really is."""
        (q_old, old_m), (q_new, new_m) = before, aligned
        R_new_old = quaternions.rotation(q_new) @ quaternions.rotation(q_old).T
        shift_m = new_m - R_new_old @ old_m
        self.alerts.move(R_new_old, shift_m)
        self._remembered.move(R_new_old, shift_m)
        self._flight.move(R_new_old, shift_m)
        self._aligned, self._placed = aligned, True

    def _align(self, seen: Pose, own: Pose) -> tuple[F64, F64]:
        """Lay SLAM's frame over the map's: z is up in both, so a turn about it and a shift are all.

        Without GNSS a path that had been lost goes on where it ended, as well as anybody knows.
        """
        turn = own.heading_rad - seen.heading_rad
        q = quaternions.from_attitude(turn, 0.0, 0.0)
        if own is not self._last:
            self.offset_enu_m, self._offset_t_s = np.zeros(3), -math.inf
            self._flown_m = 0.0
        self._last = None
        return q, own.position_enu_m - quaternions.rotation(q) @ seen.position_enu_m

    def _measure(self, pose: Pose, own: Pose | str) -> None:
        """How far the two paths are apart; what the ground and the mission are shifted by."""
        if self._last is not None:
            self._flown_m += float(np.linalg.norm(pose.position_enu_m - self._last.position_enu_m))
        self._last = pose
        if isinstance(own, str) or not self._placed:
            return
        apart = pose.position_enu_m - own.position_enu_m
        share = 1 - math.exp(-(pose.t_mono_s - self._offset_t_s) / OFFSET_SMOOTHING_S)
        self.offset_enu_m = self.offset_enu_m + share * (apart - self.offset_enu_m)
        self._offset_t_s = pose.t_mono_s
        self.divergence_m = float(np.linalg.norm(apart))

    def _with_divergence(self, result: FrameResult) -> FrameResult:
        limit_m = DIVERGED_M + DIVERGED_SHARE * self._flown_m
        apart_m = self.divergence_m or 0.0
        self._diverged = apart_m > limit_m * (CLOSER_AGAIN if self._diverged else 1.0)
        text = f"vision: the camera's path and GNSS are {apart_m:.1f} m apart. One of them is wrong."
        said = self.alerts.say("divergence", self._diverged, text, result.t_mono_s)
        return replace(result.with_alerts(said, divergence_m=self.divergence_m), placed=self._placed)

    def _points_enu(self, cloud: CloudFrame, pose: Pose) -> F64:
        """(N, 3) believable points in the map's frame."""
        xyz = self._thinned(cloud.points_m)
        points, broken, absurd = _believable(xyz, pose.rotation_enu_body, pose.position_enu_m, NEAREST_M, FARTHEST_M)
        self._count("points: not finite", broken)
        self._count("points: absurd range", absurd)
        return points

    def _thinned(self, xyz_m: F32) -> F32:
        """What is no number is left to be counted, not to be thinned."""
        voxel_m = self.settings.cloud_voxel_m
        if voxel_m <= 0.0:
            return xyz_m
        finite = np.isfinite(xyz_m).all(axis=1)
        return np.concatenate([thinned(xyz_m[finite], voxel_m), xyz_m[~finite]])

    def _insert(self, points: F64, pose: Pose, *, singly: bool) -> None:
        centres = voxel_centres(points, self.map.resolution_m, 1 if singly else FEWEST_POINTS)
        explained = self._explained(centres, pose)
        self.map.insert_hits(centres, explained=explained)
        if self._stands_on_one_path(pose.t_mono_s):
            self._flight.take(centres, explained)

    def _explained(self, centres: F64, pose: Pose) -> Bools | None:
        """(N,) Which voxels are known ground; None: nothing is known of it."""
        ground = self._known_ground
        if ground is None:
            return None
        beneath, eye = centres - self.offset_enu_m, pose.position_enu_m - self.offset_enu_m
        away = np.linalg.norm(beneath - eye, axis=1)
        share = SIGMAS * DEPTH_SIGMA_PER_M2 * away
        spread = share * away * (1 + 2 * share)  # sigma grows with the true distance, which may be the larger one
        return ground.explains_rays(eye, beneath, spread, self._within_m)

    def _stands_on_one_path(self, t_mono_s: float) -> bool:
        """Not between the two poses of a break; after one the map of the flight begins a new part."""
        while self._breaks and t_mono_s >= self._breaks[0].from_t_s:
            self._flight.begin_part(self._breaks.popleft().why, t_mono_s)
        return not self._breaks or t_mono_s <= self._breaks[0].after_t_s

    def _pose_state(self, now_mono_s: float) -> tuple[State, str]:
        if self._tracking == "lost":
            return "blind", "The camera has lost its way: too dark, or nothing fixed in view."
        if self._aligned is None:
            return "frozen", "No path of the camera's own SLAM yet: its map has no place."
        if 0 <= self._points < BLIND_POINTS:
            return "blind", "The camera sees nothing: too dark, or nothing in view within 40 m."
        return "running", ""


@njit(cache=True, nogil=True)
def _believable(xyz, R, p, nearest_m, farthest_m):
    """((M, 3) points in the map's frame, how many were not finite, how many too near or too far)"""
    out = np.empty((xyz.shape[0], 3))
    kept, broken = 0, 0
    for k in range(xyz.shape[0]):
        x, y, z = np.float64(xyz[k, 0]), np.float64(xyz[k, 1]), np.float64(xyz[k, 2])
        away_sq = x * x + y * y + z * z
        if not math.isfinite(away_sq):
            broken += 1
        elif nearest_m * nearest_m <= away_sq <= farthest_m * farthest_m:
            for i in range(3):
                out[kept, i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z + p[i]
            kept += 1
    return out[:kept], broken, xyz.shape[0] - kept - broken


def voxel_centres(points: F64, resolution_m: float, fewest: int) -> F64:
    """(N, 3) points -> (M, 3) centres of the voxels that hold ``fewest`` of them or more."""
    if len(points) == 0:
        return np.empty((0, 3))
    keys = np.floor(points / resolution_m).astype(np.int64)
    low = keys.min(axis=0)
    span = keys.max(axis=0) - low + 1
    packed = ((keys[:, 0] - low[0]) * span[1] + keys[:, 1] - low[1]) * span[2] + keys[:, 2] - low[2]
    unique, counts = np.unique(packed, return_counts=True)
    unique = unique[counts >= fewest]
    kept = np.column_stack([unique // (span[1] * span[2]), unique // span[2] % span[1], unique % span[2]])
    return (kept + low + 0.5) * resolution_m
