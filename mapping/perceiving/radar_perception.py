"""Perception from the radar: a global map of everything it has seen, at the vehicle's GNSS position."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.poses import Pose
from mapping.perceiving.frame_result import FrameResult, Settings
from mapping.perceiving.perception import Perception
from mapping.perceiving.radar_evidence import RadarEvidence, side_lobes
from mapping.perceiving.radar_passing import Passing
from mapping.perceiving.remembered import Field
from mapping.radar.targets import Gate, in_gate, polar, to_enu
from mapping.sensor_frames import RadarFrame

MOST_TARGETS = 2000
"""In one frame; the AWR1843 sends a few hundred at most."""
FASTEST_M_S = 200.0
SNR_LIMITS_DB = (-30.0, 120.0)


@dataclass(frozen=True, slots=True)
class Targets:
    """Of one frame, as they were measured."""

    t_mono_s: float
    xyz_m: F64
    """(N, 3) body frame, all whose numbers are finite"""
    kept: Bools
    """(N,) through the gate"""


class RadarTargets:
    """Which targets of a radar's frames are taken; ``dropped`` counts the others, by reason."""

    def __init__(self, dropped: Counter[str]) -> None:
        self.gate = Gate()
        self.newest: Targets | None = None
        self._dropped = dropped

    def kept(self, frame: RadarFrame) -> tuple[F64, F64, F64, Bools]:
        """Believable numbers inside the gate, and which of them are side lobes' ghosts; the rest is counted."""
        xyz, speed, snr = (column.astype(np.float64) for column in frame.columns())
        finite = np.isfinite(xyz).all(axis=1) & np.isfinite(speed) & np.isfinite(snr)
        self._count("points: not finite", len(xyz) - int(finite.sum()))
        self._count(f"points: more than {MOST_TARGETS:,} in a frame", max(0, int(finite.sum()) - MOST_TARGETS))
        xyz, speed, snr = xyz[finite][:MOST_TARGETS], speed[finite][:MOST_TARGETS], snr[finite][:MOST_TARGETS]
        range_m = np.linalg.norm(xyz, axis=1)
        all_xyz = xyz
        good = (range_m >= self.gate.nearest_m) & (range_m <= self.gate.farthest_m)
        good &= (np.abs(speed) <= FASTEST_M_S) & (snr >= SNR_LIMITS_DB[0]) & (snr <= SNR_LIMITS_DB[1])
        self._count("points: absurd range, speed or strength", len(good) - int(good.sum()))
        xyz, speed, snr = xyz[good], speed[good], snr[good]
        targets = polar(xyz)
        inside = in_gate(targets, self.gate)
        self._count("points: outside the gate", len(inside) - int(inside.sum()))
        kept = np.zeros(len(all_xyz), np.bool_)
        kept[good] = inside
        self.newest = Targets(frame.t_mono_s, all_xyz, kept)
        return xyz[inside], speed[inside], snr[inside], side_lobes(targets, snr)[inside]

    def _count(self, what: str, count: int) -> None:
        if count:
            self._dropped[what] += count


def gate_of(settings: Settings) -> Gate:
    return Gate(settings.gate_azimuth_rad, settings.gate_low_rad, settings.gate_high_rad)


class RadarPerception(Perception):
    """The radar's map. Nothing is ever taken out of it; what is accounted for, or not yet believed, or has only passed
    by, is "explained"."""

    name = "radar"

    def __init__(self, settings: Settings, *, alert_prefix: str = "") -> None:
        super().__init__(settings, alert_prefix=alert_prefix)
        self.targets = RadarTargets(self.dropped)
        self._evidence, self._passing = RadarEvidence(), Passing()
        self._look_through_the_gate()

    def set_settings(self, settings: Settings) -> None:
        super().set_settings(settings)
        self._look_through_the_gate()

    @staticmethod
    def reach_down(settings: Settings) -> float:
        """Targets are put at the vehicle's height but may stand as high as the gate reaches."""
        return math.tan(max(0.0, settings.gate_high_rad))

    def _look_through_the_gate(self) -> None:
        """What is expected of known ground is what the gate lets through."""
        gate = self.targets.gate = gate_of(self.settings)
        self.field = Field(gate.nearest_m, gate.azimuth_rad)
        self._evidence.set_gate(gate)

    def on_frame(self, frame: RadarFrame, now_mono_s: float) -> FrameResult:
        """Take one frame; never raises for what is in it."""
        pose = self._pose_for(frame, now_mono_s)
        if isinstance(pose, FrameResult):
            return pose
        xyz, speed, snr, ghost = self.targets.kept(frame)
        self._insert(frame.t_mono_s, pose, xyz, speed, snr, ghost)
        return self._look(frame.t_mono_s, now_mono_s, pose, len(xyz))

    def _insert(self, t_mono_s: float, pose: Pose, xyz: F64, speed: F64, snr: F64, ghost: Bools) -> None:
        points = to_enu(xyz, pose.position_enu_m, pose.rotation_enu_body, pose.heading_rad, self.settings.radar_variant)
        if self.settings.paper_bare:
            self.map.insert_hits(points)
            return
        targets = polar(xyz)
        weight = self._evidence.weights(targets, snr, speed, pose, self._known_ground)
        weight = np.where(ghost, 0.0, weight)
        believed, earlier = self._evidence.judge(t_mono_s, points, weight)
        self.map.insert_hits(points, explained=~believed)
        if len(earlier):
            self.map.mark_explained(np.floor(earlier / self.map.resolution_m).astype(np.int32), False)
        moving = self._evidence.moving(targets, snr, speed, pose)
        surplus = self._evidence.over_ground_m_s(targets, speed, pose)
        told = moving & (weight > 0)
        self._passing.look_at_speeds(speed)
        self._passing.remember(t_mono_s, points[told], speed[told], surplus[told], pose)
        self._take_back(t_mono_s, np.concatenate([points[believed], earlier]), moving[believed])

    def _take_back(self, t_mono_s: float, points: F64, moving: Bools) -> None:
        """What was believed earlier than now is of what is seen beside it."""
        unsure = np.ones(len(points) - len(moving), np.bool_)
        keys, columns = self._passing.observe(t_mono_s, points, np.concatenate([moving, unsure]), self.map.resolution_m)
        if len(keys):
            self.map.mark_explained(keys, True)
            self._evidence.disbelieve(columns)

    def _forget(self) -> None:
        super()._forget()
        self._evidence.clear()
        self._passing.clear()
