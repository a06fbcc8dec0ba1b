"""Simulated sensors: what a radar, a stereo camera and its SLAM would say of a simulated world."""

from telemetry.simulation.simulator.sensors.radar_model import RadarModel
from telemetry.simulation.simulator.sensors.radar_sensor import RadarSensor, radar_sensor
from telemetry.simulation.simulator.sensors.slam import SlamDrift
from telemetry.simulation.simulator.sensors.stereo import StereoModel, StereoSensor

__all__ = [
    "RadarModel",
    "RadarSensor",
    "SlamDrift",
    "StereoModel",
    "StereoSensor",
    "radar_sensor",
]
