"""Simulated sensors: what a radar, a stereo camera and its SLAM would say of a simulated world."""

from telemetry.simulator.sensors.radar import RadarSensor
from telemetry.simulator.sensors.radar_model import RadarModel
from telemetry.simulator.sensors.radars import radar_sensor
from telemetry.simulator.sensors.slam import SlamDrift
from telemetry.simulator.sensors.stereo import StereoModel, StereoSensor

__all__ = [
    "RadarModel",
    "RadarSensor",
    "SlamDrift",
    "StereoModel",
    "StereoSensor",
    "radar_sensor",
]
