"""The simulated camera's SLAM: a pose in a frame of its own that drifts with the way flown."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from mapping.sensor_frames import SlamPose
from telemetry.simulation.simulator.sensors.body import of_truth, quaternion_wxyz, rotation_enu_body
from telemetry.topics.vehicle import SimTruth

DRIFT = 0.01
"""Of the way flown."""
POOR_SHARE, LOST_SHARE = 0.05, 0.002
"""With fewer of its points fixed to something SLAM is poor, then lost."""
POOR_TIMES, LOST_TIMES = 5.0, 20.0
"""How much faster it drifts then."""
LOST_M_S = 0.3
"""A lost one also drifts where it stands."""
TURN_M = 60.0
"""Way after which the drift points somewhere else."""


class SlamDrift:
    """Feed it every truth in order; the frame's origin and heading are the seed's."""

    def __init__(self, *, seed: int) -> None:
        self._random = np.random.default_rng([seed, 4])
        yaw_rad = self._random.uniform(-math.pi, math.pi)
        self._slam_enu = rotation_enu_body(0.0, 0.0, yaw_rad).T
        self._origin_enu: np.ndarray | None = None
        self._last: SimTruth | None = None
        self._error = np.zeros(3)
        self._towards = self._direction()
        self._left_m = TURN_M

    def pose(self, truth: SimTruth, share_seen: float = 1.0) -> SlamPose:
        """``share_seen``: of the camera's points, those on something fixed (``StereoSensor.share_seen``)."""
        tracking = _tracking(share_seen)
        position = np.array(truth.position_enu_m)
        if self._origin_enu is None:
            self._origin_enu = position
        if self._last is not None:
            self._drift(truth, self._last, tracking)
        self._last = truth
        x, y, z = (self._slam_enu @ (position - self._origin_enu) + self._error).tolist()
        return SlamPose(truth.t_mono_s, (x, y, z), quaternion_wxyz(self._slam_enu @ of_truth(truth)), tracking)

    def _drift(self, truth: SimTruth, last: SimTruth, tracking: Literal["good", "poor", "lost"]) -> None:
        way_m = math.dist(truth.position_enu_m, last.position_enu_m)
        times = {"good": 1.0, "poor": POOR_TIMES, "lost": LOST_TIMES}[tracking]
        step_m = DRIFT * times * way_m
        if tracking == "lost":
            step_m += LOST_M_S * max(0.0, truth.t_sim_s - last.t_sim_s)
        self._error = self._error + step_m * self._towards
        self._left_m -= way_m
        if self._left_m <= 0:
            self._towards, self._left_m = self._direction(), TURN_M

    def _direction(self) -> np.ndarray:
        """Mostly level: gravity is felt."""
        around = self._random.uniform(-math.pi, math.pi)
        return np.array([math.sin(around), math.cos(around), 0.2 * self._random.uniform(-1, 1)])


def _tracking(share_seen: float) -> Literal["good", "poor", "lost"]:
    if share_seen < LOST_SHARE:
        return "lost"
    return "poor" if share_seen < POOR_SHARE else "good"
