"""Perception of what moves: believed radar targets into a tracker instead of a map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.poses import Pose
from mapping.perceiving.frame_result import FrameResult, Settings, State
from mapping.perceiving.ground import GroundGrid
from mapping.perceiving.perception import Perception
from mapping.perceiving.radar_evidence import EvidenceParams, RadarEvidence
from mapping.perceiving.radar_perception import RadarTargets, gate_of
from mapping.radar.targets import polar, to_enu
from mapping.sensor_frames import RadarFrame
from mapping.tracking.blobs import Blobs, blobs
from mapping.tracking.tracker import Tracker
from mapping.tracking.tracker_params import TrackState

LEVEL_RAD = math.radians(-10.0)
"""Elevations are measured to 7 degrees: from 0 on, half of the echoes of what comes at the same height were lost."""
EVIDENCE = EvidenceParams(most_aside_m=2.5)
"""A track knows how uncertain its place is; a map's voxel does not, which is why maps take nothing that far off."""
LOW_M = 2.0
"""Above known ground: lower, while it takes off and lands, every echo grazes it."""
MOST_TARGETS = 250
"""A thousand objects in a frame must not hold up the next one: what moves counts first, then what is nearest."""


class Movers(Perception):
    """Frames, poses and ground as for any sensor's map, which stays empty here. ``states`` are of the newest frame."""

    name = "radar"

    def __init__(self, settings: Settings, tracker: Tracker, *, alert_prefix: str = "") -> None:
        """``tracker`` is emptied; it outlives this flight so that no id is ever used twice."""
        super().__init__(settings, alert_prefix=alert_prefix)
        self._targets, self._evidence = RadarTargets(self.dropped), RadarEvidence(EVIDENCE)
        self._look_through_the_gate()
        self._tracker = tracker
        tracker.clear()
        self._has_velocity = True
        self.states: list[TrackState] = []
        self.blobs: Blobs | None = None
        self.pose: Pose | None = None

    @property
    def ground(self) -> GroundGrid | None:
        """The surface model under the vehicle, whether it explains echoes or, as in the papers, nothing does."""
        return self._ground

    @property
    def is_flying(self) -> bool:
        """On the ground nothing alarms."""
        return self._flying

    def feed_position(
        self, t_mono_s: float, enu_m: ArrayLike, velocity_enu_m_s: ArrayLike | None = None, *, has_fix: bool = True
    ) -> None:
        """Without its velocity what moves cannot be told from what stands still."""
        self._has_velocity = velocity_enu_m_s is not None
        super().feed_position(t_mono_s, enu_m, velocity_enu_m_s, has_fix=has_fix)

    def on_frame(self, frame: RadarFrame, now_mono_s: float) -> FrameResult:
        """One step of the tracker; never raises for what is in the frame."""
        pose = self._pose_for(frame, now_mono_s)
        if isinstance(pose, FrameResult):
            return pose
        if not self._has_velocity:
            return self._drop(frame, "no velocity", now_mono_s)
        xyz, speed, snr, ghost = self._targets.kept(frame)
        self.pose, self.blobs = pose, self._believed(frame.t_mono_s, pose, xyz, speed, snr, ghost)
        self.states = self._tracker.step(
            frame.t_mono_s,
            self.blobs.detections,
            position_enu_m=pose.position_enu_m[:2],
            velocity_enu_m_s=pose.velocity_enu_m_s[:2],
            heading_rad=pose.heading_rad,
        )
        self.frames += 1
        state, text = self._state(now_mono_s)
        return FrameResult(
            t_mono_s=frame.t_mono_s, state=state, text=text, accepted=True, pose=pose, points=len(self.blobs)
        )

    def _believed(self, t_mono_s: float, pose: Pose, xyz: F64, speed: F64, snr: F64, ghost: Bools) -> Blobs:
        """What moves for sure, and what neither known ground nor noise accounts for: something that crosses the line
        of sight at right angles has the radial speed of what stands still, all the way into a collision."""
        moving = self._evidence.moving(polar(xyz), snr, speed, pose) & ~ghost
        most = np.lexsort((np.hypot(xyz[:, 0], xyz[:, 1]), ~moving))[:MOST_TARGETS]
        xyz, speed, snr, ghost, moving = xyz[most], speed[most], snr[most], ghost[most], moving[most]
        targets, ground = polar(xyz), self._known_ground
        weight = np.where(ghost, 0.0, self._evidence.weights(targets, snr, speed, pose, ground))
        points = to_enu(xyz, pose.position_enu_m, pose.rotation_enu_body, pose.heading_rad, "heading_only")
        believed, _ = self._evidence.judge(t_mono_s, points, weight)
        fed = moving | (believed & (weight > 0))
        if ground is not None and pose.position_enu_m[2] - ground.up(pose.position_enu_m[None, :])[0] < LOW_M:
            fed[:] = False
        return blobs(polar(xyz[fed]), speed[fed], snr[fed], moving[fed])

    def set_settings(self, settings: Settings) -> None:
        super().set_settings(settings)
        self._look_through_the_gate()

    def _look_through_the_gate(self) -> None:
        gate = gate_of(self.settings)
        self._evidence.set_gate(gate)
        self._targets.gate = replace(gate, elevation_low_rad=min(LEVEL_RAD, gate.elevation_low_rad))

    def _forget(self) -> None:
        super()._forget()
        self._evidence.clear()

    def _pose_state(self, now_mono_s: float) -> tuple[State, str]:
        state, text = super()._pose_state(now_mono_s)
        if state == "running" and not self._has_velocity:
            return "frozen", "The vehicle's own velocity is unknown: nothing is followed."
        return state, text.replace("the radar map stands still", "nothing is followed")
