"""What of a sensor's newest frame is shown to those who look: all of the radar's targets, some of a cloud's points."""

from __future__ import annotations

import math

import numpy as np

from mapping.perceiving.radar_perception import RadarPerception
from mapping.perceiving.range_perception import RangePerception
from mapping.perceiving.vision_perception import VisionPerception
from mapping.sensor_frames import packed
from telemetry.topics.looks import CloudLook, RadarLook, packed_cm
from telemetry.topics.obstacles import MapOrigin

SHOWN_EVERY_S = 0.5
MOST_TARGETS = 500
MOST_POINTS = 4_000
"""Twice a second: 48 kB/s, on the bus, on disk and to a page that shows them."""


AnyPerception = RadarPerception | VisionPerception | RangePerception


class Showing:
    """Of one sensor: each frame at most once, and not every frame."""

    def __init__(self, utc_minus_mono_s: float) -> None:
        self._utc_minus_mono_s = utc_minus_mono_s
        self._shown_s = self._newest_t_s = -math.inf

    def due(self, perception: AnyPerception, origin: MapOrigin | None, now_s: float) -> RadarLook | CloudLook | None:
        if now_s < self._shown_s + SHOWN_EVERY_S:
            return None
        look = look_of(perception, origin, utc_minus_mono_s=self._utc_minus_mono_s)
        if look is None or look.t_mono_s == self._newest_t_s:
            return None
        self._shown_s, self._newest_t_s = now_s, look.t_mono_s
        return look


def look_of(
    perception: AnyPerception,
    origin: MapOrigin | None,
    *,
    utc_minus_mono_s: float,
) -> RadarLook | CloudLook | None:
    """None while there is nothing to show, or nobody knows where it lies."""
    if isinstance(perception, RadarPerception):
        return _radar(perception, utc_minus_mono_s)
    if isinstance(perception, VisionPerception) and origin is not None:
        return _cloud(perception, origin, utc_minus_mono_s)
    return None


def _radar(perception: RadarPerception, utc_minus_mono_s: float) -> RadarLook | None:
    frame, gate = perception.targets.newest, perception.targets.gate
    if frame is None:
        return None
    return RadarLook(
        frame.t_mono_s,
        frame.t_mono_s + utc_minus_mono_s,
        packed(frame.xyz_m[:MOST_TARGETS]),
        frame.kept[:MOST_TARGETS].astype(np.uint8).tobytes(),
        gate.azimuth_rad,
        gate.elevation_low_rad,
        gate.elevation_high_rad,
        gate.nearest_m,
        gate.farthest_m,
    )


def _cloud(perception: VisionPerception, origin: MapOrigin, utc_minus_mono_s: float) -> CloudLook | None:
    """Every so manieth point, so that no part of the picture is left out."""
    frame = perception.newest
    if frame is None or not perception.placed:
        return None
    every = max(1, -(-len(frame.points_m) // MOST_POINTS))
    east, north, up = (float(value) for value in frame.eye_m)
    points = frame.points_m[::every] - frame.eye_m
    t_s = frame.t_mono_s
    return CloudLook(t_s, t_s + utc_minus_mono_s, origin, (east, north, up), packed_cm(points))
