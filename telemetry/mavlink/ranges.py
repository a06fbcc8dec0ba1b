"""Ranges that a vehicle's own sensors measure: OBSTACLE_DISTANCE and DISTANCE_SENSOR as frames for the bus."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from telemetry.sensing import RangeFrame

_NORTH_ALIGNED = 0
"""MAV_FRAME_GLOBAL: the first sector points north, not ahead."""
_UNKNOWN_CM = 65535
_INVALID_SIGNAL = 1
_UP, _DOWN = 24, 25
_LEVEL = {number: math.radians(45.0 * number) for number in range(8)}
"""MAV_SENSOR_ROTATION_YAW_*, clockwise from the nose."""

Beams = list[tuple[float, float, float]]
"""(bearing, elevation, range)"""


class RangeReader:
    """Of one vehicle; counts the frames of each of its sensors."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def on_message(
        self, message: Any, *, heading_rad: float | None, t_mono_s: float, t_utc_s: float
    ) -> RangeFrame | None:
        """None for any other message, and for one that cannot be understood."""
        reader = _READERS.get(message.get_type())
        beams = None if reader is None else reader(message, heading_rad)
        if beams is None:
            return None
        source = f"{message.get_type()} {message.get_srcComponent()}"
        if message.get_type() == "DISTANCE_SENSOR":
            source += f"/{message.id}"
        number = self._numbers[source] = self._numbers.get(source, -1) + 1
        bearing, elevation, range_m = zip(*beams, strict=True) if beams else ((), (), ())
        return RangeFrame(t_mono_s, t_utc_s, number, source, bearing, elevation, range_m)


def _obstacle_distance(message: Any, heading_rad: float | None) -> Beams | None:
    """Up to 72 sectors; a distance beyond the largest one means that there is nothing."""
    turn_rad = 0.0
    if message.frame == _NORTH_ALIGNED:
        if heading_rad is None:
            return None
        turn_rad = -heading_rad
    step_deg = message.increment_f or float(message.increment)
    if not (math.isfinite(step_deg) and step_deg != 0.0 and math.isfinite(message.angle_offset)):
        return None
    return [
        ((math.radians(message.angle_offset + number * step_deg) + turn_rad) % math.tau, 0.0, distance_cm / 100.0)
        for number, distance_cm in enumerate(message.distances)
        if distance_cm != _UNKNOWN_CM and distance_cm <= message.max_distance
    ]


def _distance_sensor(message: Any, _: float | None) -> Beams | None:
    direction = _direction(message.orientation)
    if direction is None or message.signal_quality == _INVALID_SIGNAL:
        return None
    distance_cm = message.current_distance
    if not message.min_distance <= distance_cm <= message.max_distance:
        return []
    return [(*direction, distance_cm / 100.0)]


def _direction(orientation: int) -> tuple[float, float] | None:
    """(bearing, elevation); None for mountings that are askew."""
    if orientation in _LEVEL:
        return _LEVEL[orientation], 0.0
    return {_UP: (0.0, math.pi / 2), _DOWN: (0.0, -math.pi / 2)}.get(orientation)


_READERS: dict[str, Callable[[Any, float | None], Beams | None]] = {
    "OBSTACLE_DISTANCE": _obstacle_distance,
    "DISTANCE_SENSOR": _distance_sensor,
}
