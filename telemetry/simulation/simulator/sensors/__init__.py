"""Simulated sensors: what a radar, a stereo camera and its SLAM would say of a simulated world."""

from telemetry.simulation.simulator.sensors.radar_model import RadarModel
from telemetry.simulation.simulator.sensors.radar_sensor import RadarSensor, radar_sensor
from telemetry.simulation.simulator.sensors.slam import SlamDrift
from telemetry.simulation.simulator.sensors.stereo import StereoModel, StereoSensor

RADAR_HZ, CLOUD_HZ, SLAM_HZ = 10.0, 5.0, 30.0

__all__ = [
    "CLOUD_HZ",
    "RADAR_HZ",
    "SLAM_HZ",
    "RadarModel",
    "RadarSensor",
    "SlamDrift",
    "StereoModel",
    "StereoSensor",
    "radar_sensor",
]
