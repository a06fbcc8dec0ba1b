"""What a camera that looks straight down sees."""

from __future__ import annotations

import math

from planning.basics.plan_model import Camera
from planning.errors import ParameterError

LOOKS_DOWN_DEG = -90.0
"""Gimbal pitch of a survey's camera."""


def height_from_gsd_m(camera: Camera, gsd_cm: float) -> float:
    """Height above the ground at which one pixel covers ``gsd_cm``.

    Melita 2020, eq. 1.
    """
    check_camera(camera)
    _positive("ground sampling distance", gsd_cm, "cm")
    return camera.image_width_px * gsd_cm * camera.focal_mm / (camera.sensor_width_mm * 100)  # Melita 2020, eq. 1


def gsd_cm(camera: Camera, height_m: float) -> float:
    """Ground sampling distance at ``height_m`` above the ground: eq. 1 of Melita 2020 the other way round."""
    check_camera(camera)
    _positive("height above ground", height_m, "m")
    return height_m * camera.sensor_width_mm * 100 / (camera.image_width_px * camera.focal_mm)  # Melita 2020, eq. 1


def footprint_m(camera: Camera, height_m: float) -> tuple[float, float]:
    """(across, along) the flight: the image's width lies across it."""
    check_camera(camera)
    _positive("height above ground", height_m, "m")
    scale = height_m / camera.focal_mm
    return camera.sensor_width_mm * scale, camera.sensor_height_mm * scale


def check_camera(camera: Camera) -> None:
    """Raise ``ParameterError`` unless all of the camera's figures are positive."""
    _positive("image width", camera.image_width_px, "px")
    _positive("image height", camera.image_height_px, "px")
    _positive("focal length", camera.focal_mm, "mm")
    _positive("sensor width", camera.sensor_width_mm, "mm")
    _positive("sensor height", camera.sensor_height_mm, "mm")


def _positive(name: str, value: float, unit: str) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ParameterError(f"The {name} is {value} {unit}.", advice="Give a positive number.")
