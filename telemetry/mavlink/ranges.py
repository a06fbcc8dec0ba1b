"""Ranges that a vehicle's own sensors measure: OBSTACLE_DISTANCE and DISTANCE_SENSOR as frames for the bus."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from mapping.sensor_frames import RangeFrame

_NORTH_ALIGNED = 0
"""MAV_FRAME_GLOBAL: the first sector points north, not ahead."""
_UNKNOWN_CM = 65535
_INVALID_SIGNAL = 1
_UP, _DOWN = 24, 25
_LEVEL = {number: math.radians(45.0 * number) for number in range(8)}
"""MAV_SENSOR_ROTATION_YAW_*, clockwise from the nose."""

LEAST_BEAM_RAD = math.radians(5.0)
"""Of a sensor that does not say how wide it looks."""


class Scan(NamedTuple):
    beams: list[tuple[float, float, float]]
    """(bearing, elevation, range) of what was hit"""
    looks_rad: list[float]
    beam_rad: float
    nearest_m: float
    farthest_m: float


class RangeReader:
    """Of one vehicle; counts the frames of each of its sensors."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def on_message(
        self, message: Any, *, heading_rad: float | None, t_mono_s: float, t_utc_s: float
    ) -> RangeFrame | None:
        """None for any other message, and for one that cannot be understood."""
        reader = _READERS.get(message.get_type())
        scan = None if reader is None else reader(message, heading_rad)
        if scan is None:
            return None
        source = f"{message.get_type()} {message.get_srcComponent()}"
        if message.get_type() == "DISTANCE_SENSOR":
            source += f"/{message.id}"
        number = self._numbers[source] = self._numbers.get(source, -1) + 1
        bearing, elevation, range_m = zip(*scan.beams, strict=True) if scan.beams else ((), (), ())
        looks, limits = tuple(scan.looks_rad), (scan.beam_rad, scan.nearest_m, scan.farthest_m)
        return RangeFrame(t_mono_s, t_utc_s, number, source, bearing, elevation, range_m, looks, *limits)


def _obstacle_distance(message: Any, heading_rad: float | None) -> Scan | None:
    """Up to 72 sectors; a distance beyond the largest one means that there is nothing."""
    turn_rad = 0.0
    if message.frame == _NORTH_ALIGNED:
        if heading_rad is None:
            return None
        turn_rad = -heading_rad
    step_deg = message.increment_f or float(message.increment)
    if not (math.isfinite(step_deg) and step_deg != 0.0 and math.isfinite(message.angle_offset)):
        return None
    measured = [
        ((math.radians(message.angle_offset + number * step_deg) + turn_rad) % math.tau, distance_cm)
        for number, distance_cm in enumerate(message.distances)
        if distance_cm != _UNKNOWN_CM
    ]
    hits = [(bearing, 0.0, cm / 100.0) for bearing, cm in measured if cm <= message.max_distance]
    return _scan(message, hits, [bearing for bearing, _ in measured], math.radians(abs(step_deg)))


def _distance_sensor(message: Any, _: float | None) -> Scan | None:
    direction = _direction(message.orientation)
    if direction is None or message.signal_quality == _INVALID_SIGNAL:
        return None
    distance_cm = message.current_distance
    hit = message.min_distance <= distance_cm <= message.max_distance
    hits = [(*direction, distance_cm / 100.0)] if hit else []
    looks = [direction[0]] if direction[1] == 0.0 and distance_cm >= message.min_distance else []
    return _scan(message, hits, looks, max(message.horizontal_fov, LEAST_BEAM_RAD))


def _scan(message: Any, hits: list[tuple[float, float, float]], looks_rad: list[float], beam_rad: float) -> Scan:
    return Scan(hits, looks_rad, beam_rad, message.min_distance / 100.0, message.max_distance / 100.0)


def _direction(orientation: int) -> tuple[float, float] | None:
    """(bearing, elevation); None for mountings that are askew."""
    if orientation in _LEVEL:
        return _LEVEL[orientation], 0.0
    return {_UP: (0.0, math.pi / 2), _DOWN: (0.0, -math.pi / 2)}.get(orientation)


_READERS: dict[str, Callable[[Any, float | None], Scan | None]] = {
    "OBSTACLE_DISTANCE": _obstacle_distance,
    "DISTANCE_SENSOR": _distance_sensor,
}
