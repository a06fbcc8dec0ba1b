"""The simulated sensors at their rates: radar 10 Hz, stereo camera 5 Hz, its SLAM 30 Hz."""

from __future__ import annotations

from collections.abc import Iterator

from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose
from telemetry.simulation.scenarios.stage.setup import Setup
from telemetry.simulation.simulator.sensors import SlamDrift, StereoSensor, radar_sensor
from telemetry.topics.vehicle import SimTruth

RADAR_HZ, CLOUD_HZ, SLAM_HZ = 10.0, 5.0, 30.0


class Sensors:
    """Measures while the vehicle is armed, from where it really is."""

    def __init__(self, setup: Setup) -> None:
        self._radar = radar_sensor(setup.radar, setup.world, seed=setup.seed) if "radar" in setup.sensors else None
        self._stereo = None
        if "vision" in setup.sensors:
            self._stereo = StereoSensor(setup.world, seed=setup.seed, dark=setup.dark)
        self._slam = SlamDrift(seed=setup.seed)
        self._due_s: dict[str, float] = dict.fromkeys(("radar", "cloud", "slam"), 0.0)

    def measure(self, truth: SimTruth) -> Iterator[RadarFrame | CloudFrame | SlamPose]:
        """What is due now."""
        if not truth.armed:
            return
        if self._stereo is not None:
            if self._is_due("slam", SLAM_HZ, truth):
                yield self._slam.pose(truth, self._stereo.share_seen)
            if self._is_due("cloud", CLOUD_HZ, truth):
                yield self._stereo.frame(truth)
        if self._radar is not None and self._is_due("radar", RADAR_HZ, truth):
            yield self._radar.frame(truth)

    def _is_due(self, name: str, hz: float, truth: SimTruth) -> bool:
        if truth.t_sim_s < self._due_s[name] - 1e-6:
            return False
        self._due_s[name] = max(self._due_s[name] + 1 / hz, truth.t_sim_s)
        return True
